"""A state that monitors a topic until a message fails a condition."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.core.idl.protocols import Message
from minirospy.ros.smach.smach.state import State
from minirospy.ros.smach.smach.user_data import Values

__all__ = ["MonitorState"]

_SHUTDOWN_CHECK = 0.1  # seconds between checks for a shutdown


class MonitorState(State):
    """A state that checks the messages on a topic against a condition.

    Outcomes: "valid" after ``max_checks`` messages that meet the condition, "invalid" at the first message that does not meet
    it, "preempted".
    """

    def __init__(
        self,
        topic: str,
        msg_type: type[Message],
        cond_cb: Callable[[Values, Message], object],
        max_checks: int = -1,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
    ) -> None:
        """Create the state. ``cond_cb`` is called with the userdata and a message.

        If ``max_checks`` is -1, there is no limit: the state runs until a message does not meet the condition.
        """
        super().__init__(
            outcomes=["valid", "invalid", "preempted"], input_keys=input_keys, output_keys=output_keys
        )
        self._topic = topic
        self._msg_type = msg_type
        self._cond_cb = cond_cb
        self._max_checks = max_checks
        self._n_checks = 0
        self._trigger_event = SignalSafeEvent()

    def execute(self, ud: Values) -> str:
        """Check messages until the outcome is known; return it. At a shutdown, the outcome is "preempted"."""
        if self.preempt_requested():
            self.service_preempt()
            return "preempted"

        self._n_checks = 0
        self._trigger_event.clear()
        subscriber = rospy.Subscriber(self._topic, self._msg_type, self._check, callback_args=ud)
        try:
            while not self._trigger_event.wait(_SHUTDOWN_CHECK):
                if rospy.is_shutdown():
                    return "preempted"
        finally:
            subscriber.unregister()

        if self.preempt_requested():
            self.service_preempt()
            return "preempted"
        return "valid" if 0 < self._max_checks <= self._n_checks else "invalid"

    def _check(self, message: Message, ud: Values) -> None:
        if self._trigger_event.is_set():
            return
        try:
            is_met = bool(self._cond_cb(ud, message))
        except Exception as error:  # noqa: BLE001 - the user's condition
            rospy.logerr(f"Error thrown while executing condition callback {self._cond_cb}: {error}")
            is_met = False
        self._n_checks += is_met
        if not is_met or 0 < self._max_checks <= self._n_checks:
            self._trigger_event.set()

    def request_preempt(self) -> None:
        """Ask the state to stop, without waiting for another message."""
        super().request_preempt()
        self._trigger_event.set()
