"""A state that waits until a function returns a true value."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable

from minirospy import client as rospy
from minirospy.ros.smach.smach.exceptions import InvalidUserCodeError
from minirospy.ros.smach.smach.state import State
from minirospy.ros.smach.smach.user_data import Values

__all__ = ["ConditionState"]


class ConditionState(State):
    """A state that waits until a condition is met.

    Outcomes: "true" when the condition is met, "false" after the last check or the timeout, "preempted".
    """

    def __init__(
        self,
        cond_cb: Callable[[Values], object],
        input_keys: Iterable[str] = (),
        poll_rate: rospy.Duration = rospy.Duration(0.05),  # noqa: B008 - a Duration does not change
        timeout: rospy.Duration | None = None,
        max_checks: int = 1,
    ) -> None:
        """Create the state. ``cond_cb`` is called with the userdata at intervals of ``poll_rate``.

        If ``max_checks`` is -1, there is no limit. As in ROS, the value n allows n + 1 checks.
        """
        super().__init__(outcomes=["true", "false", "preempted"], input_keys=input_keys)
        if hasattr(cond_cb, "get_registered_input_keys") and hasattr(cond_cb, "get_registered_output_keys"):
            self.register_input_keys(cond_cb.get_registered_input_keys())
            self.register_output_keys(cond_cb.get_registered_output_keys())
        self._cond_cb = cond_cb
        self._poll_rate = poll_rate
        self._timeout = timeout
        self._max_checks = max_checks

    def execute(self, ud: Values) -> str:
        """Check the condition until it is met, the checks or the time run out, or the state is preempted; return the outcome."""
        start = rospy.Time.now()
        checks = 0
        while self._max_checks == -1 or checks <= self._max_checks:
            if self._timeout and rospy.Time.now() - start > self._timeout:
                break
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            try:
                if self._cond_cb(ud):
                    return "true"
            except Exception as error:
                raise InvalidUserCodeError(
                    f"Error thrown while executing condition callback {self._cond_cb}: {traceback.format_exc()}"
                ) from error
            checks += 1
            rospy.sleep(self._poll_rate)

        return "false"
