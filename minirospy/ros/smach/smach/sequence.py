"""A state machine whose states run in the order they were added."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from minirospy.ros.smach.smach.exceptions import SmachError
from minirospy.ros.smach.smach.log import logerr
from minirospy.ros.smach.smach.state import State
from minirospy.ros.smach.smach.state_machine import StateMachine, Transitions

__all__ = ["Sequence"]


class Sequence(StateMachine):
    """Executes its states in order until one returns an outcome other than the connector outcome."""

    def __init__(
        self,
        outcomes: Iterable[str],
        connector_outcome: str,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys)
        self._connector_outcome = connector_outcome
        self._last_added_seq_label: str | None = None

    @staticmethod
    def add(
        label: str,
        state: State,
        transitions: Transitions | None = None,
        remapping: Mapping[str, str] | None = None,
        constants: Mapping[str, object] | None = None,
    ) -> object:
        """Add a state. The previous state's connector outcome leads to it, unless that outcome already has a target."""
        sequence = Sequence._currently_opened_container()
        last = sequence._last_added_seq_label
        if last is not None:
            targets = sequence._transitions[last]
            if targets.get(sequence._connector_outcome) is None:
                targets[sequence._connector_outcome] = label
            try:
                sequence.check_state_spec(last, sequence._states[last], targets)
            except SmachError:
                logerr("Attempting to construct smach state sequence failed.")

        sequence._last_added_seq_label = label
        return sequence._add(label, state, transitions, remapping, constants)
