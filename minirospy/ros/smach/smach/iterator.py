"""The container that executes one state once per item."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from minirospy.ros.smach.smach.container import Container
from minirospy.ros.smach.smach.exceptions import InvalidStateError, InvalidUserCodeError
from minirospy.ros.smach.smach.log import logerr, loginfo, logwarn
from minirospy.ros.smach.smach.state import State
from minirospy.ros.smach.smach.user_data import UserData, Values
from minirospy.ros.smach.smach.util import is_shutdown

__all__ = ["Iterator"]

Items = Iterable[object] | Callable[[], Iterable[object]]


class Iterator(Container):
    """Executes its state once per item, with the item in the userdata, until an outcome breaks the loop or no items are left."""

    def __init__(
        self,
        outcomes: Iterable[str],
        input_keys: Iterable[str],
        output_keys: Iterable[str],
        it: Items = (),
        it_label: str = "it_data",
        exhausted_outcome: str = "exhausted",
    ) -> None:
        """Create the container.

        ``it``: the items, or a function that returns them; ``it_label``: the userdata key for the current item.
        """
        super().__init__([*outcomes, exhausted_outcome], input_keys, output_keys)
        self._items = it
        self._items_label = it_label
        self._exhausted_outcome = exhausted_outcome

        self._is_running = False
        self._state_label = ""
        self._state: Any = None
        self._loop_outcomes: list[str] = []
        self._break_outcomes: list[str] = []
        self._final_outcome_map: Mapping[str, str] = {}

    # Construction.

    @staticmethod
    def set_iteritems(it: Items, it_label: str = "it_data") -> None:
        """Set the open iterator's items, or a function that returns them, and the userdata key that holds the current item."""
        iterator = Iterator._currently_opened_container()
        iterator._items = it
        iterator._items_label = it_label

    @staticmethod
    def set_contained_state(
        label: str,
        state: State,
        loop_outcomes: Sequence[str] = (),
        break_outcomes: Sequence[str] = (),
        final_outcome_map: Mapping[str, str] | None = None,
    ) -> None:
        """Set the open iterator's state.

        An outcome in ``break_outcomes`` ends the loop; if ``break_outcomes`` is empty, any outcome that is not in
        ``loop_outcomes`` does. ``final_outcome_map`` maps the state's last outcome to the iterator's outcome.
        """
        iterator = Iterator._currently_opened_container()
        if loop_outcomes and break_outcomes:
            logwarn(
                "Both loop_outcomes and break_outcomes were specified when constructing SMACH iterator container."
            )
        outcomes = state.get_registered_outcomes()
        if break_outcomes:
            iterator._break_outcomes = list(break_outcomes)
            iterator._loop_outcomes = [each for each in outcomes if each not in break_outcomes]
        else:
            iterator._loop_outcomes = list(loop_outcomes)
            iterator._break_outcomes = [each for each in outcomes if each not in loop_outcomes]
        iterator._state_label, iterator._state = label, state
        iterator._final_outcome_map = final_outcome_map or {}

    def check_consistency(self) -> None:
        """Do nothing, as in ROS: ``execute`` raises an error if there is no state."""

    # Execution.

    def execute(self, parent_ud: Values | None = None) -> str | None:
        """Execute the state for each item. Return the container's outcome for the last one, or for running out of items."""
        if self._state is None:
            raise InvalidStateError("No contained state was set in iterator")
        self._is_running = True
        self._executing_thread = threading.get_ident()
        try:
            self._copy_input_keys(parent_ud, self.userdata)
            self.call_start_cbs()
            last = self._iterate()
            outcome = self._final_outcome_map.get(last or "", last)
            self._copy_output_keys(self.userdata, parent_ud)
        finally:
            self._is_running = False
        self.call_termination_cbs(self._state_label, outcome)
        return outcome

    def _iterate(self) -> str | None:
        outcome: str | None = self._exhausted_outcome
        items = iter(self._items() if callable(self._items) else self._items)
        while not is_shutdown():
            try:
                item = next(items)
            except StopIteration:
                return self._exhausted_outcome
            loginfo(f"Iterating {item} of {self._items}")
            self.userdata[self._items_label] = item
            outcome = self._execute_state()
            if (
                self._preempt_requested
                or outcome in self._break_outcomes
                or (self._loop_outcomes and outcome not in self._loop_outcomes)
            ):
                self._preempt_requested = False
                return outcome
            self.call_transition_cbs()

        return outcome

    def _execute_state(self) -> str | None:
        try:
            outcome: str | None = self._state.execute(self.userdata)
        except InvalidUserCodeError:
            logerr(f"Could not execute Iterator state '{self._state_label}'")
            raise
        except Exception as error:
            raise InvalidUserCodeError(
                f"Could not execute iterator state '{self._state_label}' of type '{self._state}': {traceback.format_exc()}"
            ) from error
        return outcome

    def is_running(self) -> bool:
        """Return whether the iterator is executing."""
        return self._is_running

    def request_preempt(self) -> None:
        """Ask the loop and its executing state to stop."""
        self._preempt_requested = True
        if self._is_running:
            self._state.request_preempt()

    # The remaining methods implement the interface of containers.

    def get_children(self) -> Mapping[str, State]:
        """Return the contained states as a dict {label: state}."""
        return {self._state_label: self._state}

    def __getitem__(self, key: str) -> State:
        """Return the contained state; for any other label, log an error and raise KeyError."""
        if key != self._state_label:
            logerr(
                f"Attempting to get state '{key}' from Iterator container. The only available state is "
                f"'{self._state_label}'."
            )
            raise KeyError(key)
        state: State = self._state
        return state

    def set_initial_state(self, initial_states: Sequence[str], userdata: UserData) -> None:
        """Add ``userdata`` to the iterator's userdata. For any state but the contained one, log an error and raise KeyError."""
        if len(initial_states) > 1:
            logwarn(
                "Attempting to set initial state to include more than one state, but Iterator container can only have one "
                "initial state."
            )
        if initial_states and initial_states[0] != self._state_label:
            logwarn(
                f"Attempting to set state '{initial_states[0]}' as initial state in Iterator container. The only available "
                f"state is '{self._state_label}'."
            )
            raise KeyError(initial_states[0])
        self.userdata.update(userdata)

    def get_initial_states(self) -> list[str]:
        """Return a list with the label of the contained state."""
        return [self._state_label]

    def get_active_states(self) -> list[str]:
        """Return a list with the state's label while the state executes, and an empty list otherwise."""
        return [self._state_label] if self._is_running else []

    def get_internal_edges(self) -> list[tuple[str, str, str | None]]:
        """Return the transitions (outcome, label, target); the target is the state itself, the iterator's outcome, or None."""
        loops: list[tuple[str, str, str | None]] = [
            (outcome, self._state_label, self._state_label) for outcome in self._loop_outcomes
        ]
        for outcome in self._break_outcomes:
            target = self._final_outcome_map.get(outcome, outcome)
            loops.append((outcome, self._state_label, None if target == outcome else target))
        return loops
