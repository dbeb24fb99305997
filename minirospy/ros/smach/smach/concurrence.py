"""The container that executes its states concurrently, each in its own thread."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence

from minirospy.base.clock import SignalSafeCondition
from minirospy.ros.smach.smach.container import Container
from minirospy.ros.smach.smach.exceptions import (
    InvalidStateError,
    InvalidTransitionError,
    InvalidUserCodeError,
)
from minirospy.ros.smach.smach.log import logdebug, logerr, loginfo, logwarn
from minirospy.ros.smach.smach.state import State
from minirospy.ros.smach.smach.user_data import Remapper, UserData, Values
from minirospy.ros.smach.smach.util import is_shutdown

__all__ = ["Concurrence"]

_SHUTDOWN_CHECK = 0.1  # seconds between checks for a shutdown


class Concurrence(Container):
    """Executes its states in parallel, and finishes when all of them have finished.

    The outcome is the return value of ``outcome_cb``, else the best match in ``outcome_map``, else ``default_outcome``.
    The outcome is "preempted" if the states finished because the container was preempted.
    """

    def __init__(
        self,
        outcomes: Iterable[str],
        default_outcome: str,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        outcome_map: Mapping[str, Mapping[str, str]] | None = None,
        outcome_cb: Callable[[dict[str, str | None]], str | None] | None = None,
        child_termination_cb: Callable[[dict[str, str | None]], object] | None = None,
    ) -> None:
        """Create the container. ``outcome_map`` maps each outcome of the container to a dict {label: outcome of that state}.

        ``child_termination_cb`` is called each time a state finishes, with the outcomes so far (None for running states).
        If it returns a true value, the other states are preempted.
        """
        known = list(outcomes)
        super().__init__(known, input_keys, output_keys)
        self._states: dict[str, State] = {}
        self._remappings: dict[str, Mapping[str, str]] = {}
        self._default_outcome = default_outcome
        self._outcome_map = outcome_map or {}
        self._outcome_cb = outcome_cb
        self._child_termination_cb = child_termination_cb
        self._check_policy(known)

        self._is_running = False
        self._threads: dict[str, threading.Thread] = {}
        self._child_outcomes: dict[str, str | None] = {}
        self._done = SignalSafeCondition()  # notified when the states that are still executing must finish
        self._lock = threading.RLock()  # guards the attributes below
        self._is_ending = False
        self._user_code_exception = False

    def _check_policy(self, outcomes: Sequence[str]) -> None:
        default = self._default_outcome
        if not (default or self._outcome_map or self._outcome_cb):
            raise InvalidStateError("Concurrence requires an outcome policy")
        errors = ""
        if default != str(default):
            errors += f"\n\tDefault outcome '{default}' does not appear to be a string."
        if default not in outcomes:
            errors += f"\n\tDefault outcome '{default}' is unregistered."
        for outcome in self._outcome_map:
            if outcome not in outcomes:
                errors += f"\n\tUnregistered outcome '{outcome}' in and_outcome_map."
        if self._outcome_cb and not callable(self._outcome_cb):
            errors += f"\n\tOutcome callback '{self._outcome_cb}' is not callable."
        if self._child_termination_cb and not callable(self._child_termination_cb):
            errors += f"\n\tChild termination callback '{self._child_termination_cb}' is not callable."
        if errors:
            raise InvalidStateError(f"Errors specifying outcome policy of concurrence: {errors}")

    # Construction.

    @staticmethod
    def add(label: str, state: State, remapping: Mapping[str, str] | None = None) -> State:
        """Add a state to the open container; return the state. ``remapping`` maps the state's keys to the container's keys."""
        concurrence = Concurrence._currently_opened_container()
        concurrence._states[label] = state
        concurrence._remappings[label] = remapping or {}
        return state

    def check_consistency(self) -> None:
        """Raise InvalidTransitionError if the outcome map refers to a state or an outcome that does not exist."""
        for outcomes in self._outcome_map.values():
            for label, outcome in outcomes.items():
                if label not in self._states:
                    raise InvalidTransitionError(
                        f"Outcome map in SMACH Concurrence references a state that does not exist: '{label}'"
                    )
                registered = self._states[label].get_registered_outcomes()
                if outcome not in registered:
                    raise InvalidTransitionError(
                        "Outcome map in SMACH Concurrence references a state outcome that does not exist. Requested state "
                        f"outcome: '{outcome}', but state '{label}' only has outcomes {registered}"
                    )

    # Execution.

    def execute(self, parent_ud: Values | None = None) -> str | None:
        """Execute all states; return the container's outcome. Raise InvalidStateError if a state fails."""
        if not self._states:
            raise InvalidStateError("No states was added to concurrence")
        self._copy_input_keys(parent_ud, self.userdata)
        loginfo(f"Concurrence starting with userdata: \n\t{self.userdata.keys()}")
        self.call_start_cbs()

        self._is_running = True
        self._executing_thread = threading.get_ident()
        try:
            self._run_states()
            outcome = self._outcome()
        finally:
            self._is_running = False
            self._threads, self._child_outcomes = {}, {}
        self.call_termination_cbs(list(self._states), outcome)
        self._copy_output_keys(self.userdata, parent_ud)
        return outcome

    def _run_states(self) -> None:
        """Start a thread for each state, wait until the states must finish, and join the threads."""
        self._is_ending = self._user_code_exception = False
        self._child_outcomes = dict.fromkeys(self._states)
        self._threads = {
            label: threading.Thread(name=f"concurrent_split:{label}", target=self._run_state, args=(label,))
            for label in self._states
        }
        for thread in self._threads.values():
            thread.start()

        while not is_shutdown():
            if self._done.wait_for(lambda: self._is_ending or self.preempt_requested(), _SHUTDOWN_CHECK):
                break
        logdebug("SMACH Concurrence preempting running states.")
        for label, state in self._states.items():
            if self._child_outcomes[label] is None:
                state.request_preempt()
        for thread in self._threads.values():
            while thread.is_alive() and not is_shutdown():
                thread.join(_SHUTDOWN_CHECK)

        if self._user_code_exception:
            raise InvalidStateError("A concurrent state raised an exception during execution.")

    def _run_state(self, label: str) -> None:
        self.call_transition_cbs()
        try:
            self._child_outcomes[label] = self._execute_state(label)
            with self._lock:
                self.call_transition_cbs()
                if self._is_last_needed():
                    self._is_ending = True
                    self._done.notify_all()
        except Exception:  # noqa: BLE001 - each error has been logged; execute() raises
            with self._lock:
                self._user_code_exception = self._is_ending = True
                self._done.notify_all()

    def _execute_state(self, label: str) -> str:
        state = self._states[label]
        userdata = Remapper(
            self.userdata,
            state.get_registered_input_keys(),
            state.get_registered_output_keys(),
            self._remappings[label],
        )
        try:
            outcome = state.execute(userdata)
        except Exception as error:
            raise InvalidStateError(
                f"Could not execute child state '{label}': {traceback.format_exc()}"
            ) from error
        if outcome is None:
            raise InvalidStateError(f"Concurrent state '{label}' returned no outcome on termination.")
        loginfo(f"Concurrent state '{label}' returned outcome '{outcome}' on termination.")
        return outcome

    def _is_last_needed(self) -> bool:
        """Return whether the container need not wait for the states that are still executing."""
        others_end = False
        if self._child_termination_cb:
            try:
                others_end = bool(self._child_termination_cb(self._child_outcomes))
            except Exception as error:
                raise InvalidUserCodeError(
                    f"Could not execute child termination callback: {traceback.format_exc()}"
                ) from error
        return others_end or None not in self._child_outcomes.values()

    def _outcome(self) -> str:
        if self.preempt_requested() and self._are_preempts_serviced():
            loginfo("Concurrence serviced preempt.")
            self.service_preempt()
            return "preempted"

        loginfo(f"Concurrent Outcomes: {self._child_outcomes}")
        outcome = self._mapped_outcome()
        if self._outcome_cb:
            try:
                chosen = self._outcome_cb(dict(self._child_outcomes))
            except Exception as error:
                raise InvalidUserCodeError(
                    f"Could not execute outcome callback '{self._outcome_cb}': {traceback.format_exc()}"
                ) from error
            if not chosen:
                logwarn(f"Outcome callback returned None, using outcome '{outcome}'")
            elif chosen != str(chosen):
                logerr(
                    f"Outcome callback returned a non-string '{chosen}', using default outcome '{self._default_outcome}'"
                )
            else:
                outcome = chosen
        return outcome

    def _are_preempts_serviced(self) -> bool:
        are_serviced = True
        for label, state in self._states.items():
            if state.preempt_requested():
                logwarn(f"State '{label}' in concurrence did not service preempt.")
                state.recall_preempt()
                are_serviced = False
        return are_serviced

    def _mapped_outcome(self) -> str:
        outcome, most = self._default_outcome, 0
        for candidate, expected in self._outcome_map.items():
            if all(self._child_outcomes[label] == expected[label] for label in expected):
                if len(expected) > most:
                    logdebug("Terminating concurrent split with mapped outcome.")
                    outcome, most = candidate, len(expected)
                else:
                    logdebug(f"Skipping mapped outcome '{candidate}' with fewer constraints.")
        return outcome

    def is_running(self) -> bool:
        """Return whether this container is executing."""
        return self._is_running

    def request_preempt(self) -> None:
        """Ask the container and its states to stop."""
        super().request_preempt()
        self._done.notify_all()

    # The remaining methods implement the interface of containers.

    def get_children(self) -> Mapping[str, State]:
        """Return a dict of the states, keyed by label."""
        return self._states

    def __getitem__(self, key: str) -> State:
        """Return the state with this label."""
        return self._states[key]

    def set_initial_state(self, initial_states: Sequence[str], userdata: UserData) -> None:
        """Add ``userdata`` to the container's userdata. ``initial_states`` has no effect: the container starts all states."""
        if 0 < len(initial_states) < len(self._states):
            logwarn(
                "Attempting to set initial states in Concurrence container, but Concurrence children are always all "
                "executed initially, ignoring call."
            )
        self.userdata.update(userdata)

    def get_initial_states(self) -> list[str]:
        """Return the labels of all states."""
        return list(self._states)

    def get_active_states(self) -> list[str]:
        """Return the labels of the executing states."""
        return [label for label, outcome in self._child_outcomes.items() if outcome is None]

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the outcome map as edges: (state's outcome, label, container's outcome)."""
        return [
            (outcome, label, target)
            for target, outcomes in self._outcome_map.items()
            for label, outcome in outcomes.items()
        ]
