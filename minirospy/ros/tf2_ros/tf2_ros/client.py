"""tf2_ros.BufferClient: looks up transforms in the buffer of a buffer_server node. Source: http://wiki.ros.org/tf2_ros."""

from __future__ import annotations

from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import LookupTransformAction, LookupTransformGoal, LookupTransformResult, TF2Error

from minirospy import client as rospy
from minirospy.base import times
from minirospy.base.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from minirospy.ros.actionlib import actionlib
from minirospy.ros.tf2_ros.tf2_ros.interface import NO_WAIT, BufferInterface
from minirospy.ros.tf2_ros.tf2_ros.messages import Moment, nanoseconds

__all__ = ["BufferClient"]

_PADDING = rospy.Duration(2)
_ERRORS: dict[int, type[TransformException]] = {
    TF2Error.LOOKUP_ERROR: LookupException,
    TF2Error.CONNECTIVITY_ERROR: ConnectivityException,
    TF2Error.EXTRAPOLATION_ERROR: ExtrapolationException,
    TF2Error.INVALID_ARGUMENT_ERROR: InvalidArgumentException,
    TF2Error.TIMEOUT_ERROR: TimeoutException,
}


class BufferClient(BufferInterface):
    """Looks up transforms on the buffer server in namespace ``ns``, so that this node need not subscribe to /tf.

    ``timeout_padding`` (a Duration) is added to a lookup's own timeout. ``check_frequency`` has no effect.
    """

    def __init__(
        self, ns: str, check_frequency: float | None = None, timeout_padding: Moment = _PADDING
    ) -> None:
        super().__init__()
        self.client = actionlib.SimpleActionClient(ns, LookupTransformAction)
        self.timeout_padding = timeout_padding
        if check_frequency is not None:
            rospy.logwarn("Argument check_frequency is deprecated and should not be used.")

    def wait_for_server(self, timeout: times.Duration = NO_WAIT) -> bool:
        """Wait for the buffer server. Return False if it is not available within ``timeout`` (zero: no limit)."""
        return self.client.wait_for_server(timeout)

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Moment, timeout: Moment = NO_WAIT
    ) -> TransformStamped:
        """Return the pose of ``source_frame`` in ``target_frame`` at ``time``. Wait up to ``timeout`` for the transform.

        Raise the exception that the server reports, such as LookupException, or TimeoutException if the server does not
        respond.
        """
        goal = LookupTransformGoal(
            target_frame=target_frame,
            source_frame=source_frame,
            source_time=_time(time),
            timeout=_duration(timeout),
        )
        return self._answer(goal)

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Moment,
        source_frame: str,
        source_time: Moment,
        fixed_frame: str,
        timeout: Moment = NO_WAIT,
    ) -> TransformStamped:
        """Return the pose of ``source_frame`` at ``source_time``, relative to ``target_frame`` at ``target_time``.

        Raise the same exceptions as :meth:`lookup_transform`.
        """
        goal = LookupTransformGoal(
            target_frame=target_frame,
            source_frame=source_frame,
            source_time=_time(source_time),
            timeout=_duration(timeout),
            target_time=_time(target_time),
            fixed_frame=fixed_frame,
            advanced=True,
        )
        return self._answer(goal)

    def can_transform(
        self, target_frame: str, source_frame: str, time: Moment, timeout: Moment = NO_WAIT
    ) -> bool:
        """Return whether the server can look up the transform within ``timeout``."""
        try:
            self.lookup_transform(target_frame, source_frame, time, timeout)
        except TransformException:
            return False
        return True

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Moment,
        source_frame: str,
        source_time: Moment,
        fixed_frame: str,
        timeout: Moment = NO_WAIT,
    ) -> bool:
        """Return whether the server can look up the transform between two times within ``timeout``."""
        try:
            self.lookup_transform_full(
                target_frame, target_time, source_frame, source_time, fixed_frame, timeout
            )
        except TransformException:
            return False
        return True

    def _answer(self, goal: LookupTransformGoal) -> TransformStamped:
        self.client.send_goal(goal)
        if not self.client.wait_for_result(goal.timeout + _duration(self.timeout_padding)):
            raise TimeoutException(
                "The LookupTransform goal sent to the BufferServer did not come back in the specified time. Something is "
                "likely wrong with the server"
            )
        if self.client.get_state() != GoalStatus.SUCCEEDED:
            raise TimeoutException(
                "The LookupTransform goal sent to the BufferServer did not come back with SUCCEEDED status. Something is "
                "likely wrong with the server."
            )

        result: LookupTransformResult | None = self.client.get_result()
        if result is None:
            raise TransformException(
                "The BufferServer returned None for result!  Something is likely wrong with the server."
            )
        if result.error.error != TF2Error.NO_ERROR:
            raise _ERRORS.get(result.error.error, TransformException)(result.error.error_string)
        return result.transform


def _time(time: Moment) -> times.Time:
    return times.Time(*divmod(nanoseconds(time), 1_000_000_000))


def _duration(span: Moment) -> times.Duration:
    return times.Duration(*divmod(nanoseconds(span), 1_000_000_000))
