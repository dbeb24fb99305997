"""The container that executes one state after another; each outcome selects the next state."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Iterable, Mapping, Sequence

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

__all__ = ["StateMachine"]

Transitions = Mapping[str, "str | None"]


class StateMachine(Container):
    """A state machine: each outcome of a state leads to another state, or becomes the outcome of the machine.

    An outcome without a target leads to the machine's outcome of the same name.
    """

    def __init__(
        self, outcomes: Iterable[str], input_keys: Iterable[str] = (), output_keys: Iterable[str] = ()
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys)
        self._states: dict[str, State] = {}
        self._transitions: dict[str, dict[str, str | None]] = {}
        self._remappings: dict[str, Mapping[str, str]] = {}
        self._constants: dict[str, Mapping[str, object]] = {}
        self._initial_state_label: str | None = None

        # For `add_auto`: the label of the last added state, and the outcomes of this state that lead to the next one.
        self._last_added_label: str | None = None
        self._connector_outcomes: Sequence[str] = ()

        self._is_running = False
        self._current_label: str | None = None
        # The preempted state, which may not have handled the request yet.
        self._preempted_label: str | None = None
        self._preempted_state: State | None = None
        # Released only while a state executes, so that a preemption never occurs between two states.
        self._state_transitioning_lock = threading.RLock()

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in vars(self).items() if name != "_state_transitioning_lock"}

    def __setstate__(self, state: dict[str, object]) -> None:
        vars(self).update(state)
        self._state_transitioning_lock = threading.RLock()

    # Construction.

    @staticmethod
    def add(
        label: str,
        state: State,
        transitions: Transitions | None = None,
        remapping: Mapping[str, str] | None = None,
        constants: Mapping[str, object] | None = None,
    ) -> object:
        """Add a state to the open machine and return the state.

        ``transitions`` maps each outcome to a label or to an outcome of the machine; ``remapping`` maps the state's keys
        to the machine's keys; ``constants`` are values that are set in the userdata before the state executes. Raise
        InvalidStateError if the label is already used, InvalidTransitionError for an outcome that the state does not
        have.
        """
        return StateMachine._currently_opened_container()._add(
            label, state, transitions, remapping, constants
        )

    @staticmethod
    def add_auto(
        label: str,
        state: State,
        connector_outcomes: Sequence[str],
        transitions: Transitions | None = None,
        remapping: Mapping[str, str] | None = None,
        constants: Mapping[str, object] | None = None,
    ) -> object:
        """Add a state like ``add``. Its outcomes in ``connector_outcomes`` lead to the state that is added next."""
        machine = StateMachine._currently_opened_container()
        machine._add(label, state, transitions, remapping, constants)
        registered = state.get_registered_outcomes()
        if not set(connector_outcomes) <= set(registered):
            raise InvalidStateError(
                f"Attempting to auto-connect states with outcomes {connector_outcomes}, but state '{label}' only has "
                f"registerd outcomes: {registered}"
            )

        machine._last_added_label = label
        machine._connector_outcomes = connector_outcomes
        return state

    def _add(
        self,
        label: str,
        state: State,
        transitions: Transitions | None,
        remapping: Mapping[str, str] | None,
        constants: Mapping[str, object] | None,
    ) -> object:
        targets = dict(transitions or {})
        logdebug(f"Adding state ({label}, {state}, {targets})")
        self.check_state_spec(label, state, targets)
        if label in self._states:
            raise InvalidStateError(
                f'Attempting to add state with label "{label}" to state machine, but this label is already being used.'
            )
        for outcome in state.get_registered_outcomes():
            targets.setdefault(outcome, None)

        if self._initial_state_label is None:
            self._initial_state_label = label
        self._states[label] = state
        self._transitions[label] = targets
        self._remappings[label] = remapping or {}
        self._constants[label] = constants or {}

        if self._last_added_label is not None:
            for outcome in self._connector_outcomes:
                self._transitions[self._last_added_label][outcome] = label
            self._last_added_label, self._connector_outcomes = None, ()
        return state

    def check_state_spec(self, label: str, state: State, transitions: Transitions) -> None:
        """Raise InvalidTransitionError if a transition is for an outcome that the state does not have."""
        registered = state.get_registered_outcomes()
        for outcome in transitions:
            if outcome not in registered:
                raise InvalidTransitionError(
                    f"Specified outcome '{outcome}' on state '{label}', which only has available registered outcomes: "
                    f"{registered}"
                )

    def check_consistency(self) -> None:
        """Raise InvalidTransitionError if there is no initial state, or if a transition's target does not exist."""
        outcomes = self.get_registered_outcomes()
        available = [*self._states, *(each for each in outcomes if each not in self._states)]
        errors = []
        if self._initial_state_label is None:
            errors.append("No initial state set.")
        elif self._initial_state_label not in self._states:
            errors.append(f"Initial state label: '{self._initial_state_label}' is not in the state machine.")

        for label, targets in self._transitions.items():
            unknown = {target: None for target in targets.values() if target and target not in available}
            if unknown:
                errors.append(f"State '{label}' references unknown states: {list(unknown)}")
            missing = [
                outcome for outcome, target in targets.items() if not target and outcome not in outcomes
            ]
            if missing:
                errors.append(f"State '{label}' references unregistered outcomes: {missing}")

        if errors:
            text = "".join(f"\n\t{error}" for error in errors)
            raise InvalidTransitionError(
                f"State machine failed consistency check: {text}\n\n\tAvailable states: {available}"
            )

    # Execution.

    def execute(self, parent_ud: Values | None = None) -> str | None:
        """Execute states; return the machine's outcome, or None if the machine is inconsistent or a shutdown comes first."""
        with self._state_transitioning_lock:
            try:
                self.check_consistency()
            except (InvalidStateError, InvalidTransitionError):
                logerr("Container consistency check failed.")
                return None

            self._is_running = True
            self._executing_thread = threading.get_ident()
            self._preempted_label = self._preempted_state = None
            self._current_label = self._initial_state_label
            self._copy_input_keys(parent_ud, self.userdata)
            loginfo(
                f"State machine starting in initial state '{self._current_label}' with userdata: \n"
                f"\t{self.userdata.keys()}"
            )
            self.call_start_cbs()

            outcome = None
            try:
                while outcome is None and self._is_running and not is_shutdown():
                    outcome = self._step()
                self._copy_output_keys(self.userdata, parent_ud)
            finally:
                self._is_running = False
        return outcome

    def _step(self) -> str | None:
        """Execute the current state. Return the machine's outcome if the state leads to one, otherwise None."""
        label = self._current_label
        if label is None or label not in self._states:
            raise InvalidStateError(
                f"State '{label}' does not exist. Available states are: {list(self._states)}"
            )
        state, transitions = self._states[label], self._transitions[label]

        self._pass_on_preempt(label, state)
        outcome = self._execute_state(label, state)
        registered = state.get_registered_outcomes()
        if outcome not in registered:
            raise InvalidTransitionError(
                f"Attempted to return outcome '{outcome}' from state '{label}' of type '{state}' which only has registered "
                f"outcomes: {registered}"
            )
        if outcome not in transitions:
            raise InvalidTransitionError(
                f"Outcome '{outcome}' of state '{label}' is not bound to any transition target. Bound transitions include: "
                f"{transitions}"
            )

        target = transitions[outcome]
        if target in self._states:
            self._current_label = target
            loginfo(f"State machine transitioning '{label}':'{outcome}'-->'{target}'")
            self.call_transition_cbs()
            return None
        return self._terminate(label, state, outcome, target)

    def _pass_on_preempt(self, label: str, state: State) -> None:
        """If the preempted state has not handled the request, preempt the next state before it executes."""
        if not self.preempt_requested():
            return
        loginfo("Preempt requested on state machine before executing the next state.")
        if self._preempted_state is None:
            self._preempt(label, state)
        elif self._preempted_state.preempt_requested():
            loginfo(
                f"Last state '{self._preempted_label}' did not service preempt. Preempting next state '{label}' before "
                "executing..."
            )
            self._preempt(label, state)
        else:
            self._preempt_requested = False
            self._preempted_state = None

    def _execute_state(self, label: str, state: State) -> str | None:
        self._state_transitioning_lock.release()

        try:
            for key, value in self._constants[label].items():
                self.userdata[key] = value
            return state.execute(
                Remapper(
                    self.userdata,
                    state.get_registered_input_keys(),
                    state.get_registered_output_keys(),
                    self._remappings[label],
                )
            )
        except InvalidUserCodeError:
            logerr(f"State '{label}' failed to execute.")
            raise
        except Exception as error:
            raise InvalidUserCodeError(
                f"Could not execute state '{label}' of type '{state}': {traceback.format_exc()}"
            ) from error
        finally:
            self._state_transitioning_lock.acquire()

    def _terminate(self, label: str, state: State, outcome: str, target: str | None) -> str:
        if self.preempt_requested() and self._preempted_state is not None and not state.preempt_requested():
            self.service_preempt()
        registered = self.get_registered_outcomes()
        if target is None or target not in registered:
            target = outcome
        if target not in registered:
            raise InvalidTransitionError(
                f"Outcome '{outcome}' of state '{label}' with transition target '{target}' is neither a registered state nor "
                "a registered container outcome."
            )
        self._current_label = None
        loginfo(f"State machine terminating '{label}':'{outcome}':'{target}'")
        self.call_termination_cbs([label], target)
        return target

    def is_running(self) -> bool:
        """Return whether the machine is executing."""
        return self._is_running

    # Preemption.

    def request_preempt(self) -> None:
        """Ask the machine and the executing state to stop."""
        with self._state_transitioning_lock:
            self._preempt_requested = True
            if self._current_label is not None:
                self._preempt(self._current_label, self._states[self._current_label])

    def _preempt(self, label: str, state: State) -> None:
        if self._preempted_state is state:
            return
        if self._preempted_state is not None:
            self._preempted_state.recall_preempt()
        self._preempted_label, self._preempted_state = label, state
        try:
            state.request_preempt()
        except Exception:  # noqa: BLE001 - the user's state
            logerr(f"Failed to preempt contained state '{label}': {traceback.format_exc()}")

    # The remaining methods implement the interface of containers.

    def get_children(self) -> Mapping[str, State]:
        """Return a dict of the states, keyed by label."""
        return self._states

    def __getitem__(self, key: str) -> State:
        """Return the state with this label. If there is no such state, log an error and raise KeyError."""
        if key not in self._states:
            logerr(
                f"Attempting to get state '{key}' from StateMachine container. The only available states are: "
                f"{list(self._states)}"
            )
            raise KeyError(key)
        return self._states[key]

    def set_initial_state(self, initial_states: Sequence[str], userdata: UserData | None = None) -> None:
        """Set the initial state for the next execution, and add ``userdata`` to the machine's userdata."""
        logdebug(f"Setting initial states to {initial_states}")
        if len(initial_states) > 1:
            logwarn(
                "Attempting to set initial state to include more than one state, but the StateMachine container can only "
                "have one initial state. Taking the first one."
            )
        if initial_states:
            self._initial_state_label = initial_states[0]
        if userdata is not None:
            self.userdata.update(userdata)

    def get_initial_states(self) -> list[str]:
        """Return a list with the label of the initial state."""
        return [str(self._initial_state_label)]

    def get_active_states(self) -> list[str]:
        """Return a list with the label of the executing state, or with "None" if no state is executing."""
        return [str(self._current_label)]

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the transitions as (outcome, label of the state, target)."""
        return [
            (outcome, label, target)
            for label, targets in self._transitions.items()
            for outcome, target in targets.items()
        ]
