"""tf2_ros.Buffer: lookups that can wait for their data. Source: http://wiki.ros.org/tf2_ros."""

from __future__ import annotations

from collections.abc import Callable

from geometry_msgs.msg import TransformStamped
from tf2_msgs.srv import FrameGraph, FrameGraphRequest, FrameGraphResponse

from minirospy import client as rospy
from minirospy.base.errors import TransformException
from minirospy.client.session import current_session
from minirospy.ros.tf2_ros.tf2_ros.core import BufferCore
from minirospy.ros.tf2_ros.tf2_ros.interface import NO_WAIT, BufferInterface
from minirospy.ros.tf2_ros.tf2_ros.messages import Moment, nanoseconds
from minirospy.ros.tf2_ros.tf2_ros.waiting import wait_until

__all__ = ["DEFAULT_CAN_TRANSFORM_POLLING_SCALE", "Buffer", "FrameGraph", "FrameGraphResponse"]

DEFAULT_CAN_TRANSFORM_POLLING_SCALE = 0.01


class Buffer(BufferCore, BufferInterface):
    """The transforms of the last ``cache_time`` (a Duration; default: 10 s), with lookups that can wait for their data.

    If ``debug``, offer the service ``~tf2_frames``, which lists the frames, unless this node already offers it. A wait
    returns after the insertion that makes the lookup possible. A wait raises an exception if simulated time jumps back by
    more than the fraction CAN_TRANSFORM_POLLING_SCALE of its timeout. Thread-safe.
    """

    def __init__(self, cache_time: Moment | None = None, debug: bool = True) -> None:
        BufferCore.__init__(self, cache_time)
        BufferInterface.__init__(self)
        if debug and rospy.resolve_name("~tf2_frames") not in current_session().offered:
            self.frame_server = rospy.Service("~tf2_frames", FrameGraph, self._get_frames)
        self.CAN_TRANSFORM_POLLING_SCALE = DEFAULT_CAN_TRANSFORM_POLLING_SCALE

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Moment, timeout: Moment = NO_WAIT
    ) -> TransformStamped:
        """Return the pose of ``source_frame`` in ``target_frame`` at ``time``; time 0 means the latest common time.

        Wait up to ``timeout`` (a Duration of ROS time) for the transform. Raise LookupException if a frame is unknown,
        ConnectivityException if the frames are not connected, ExtrapolationException if there is no data for ``time``,
        InvalidArgumentException if a frame name is invalid, ROSInterruptException at a shutdown, and
        ROSTimeMovedBackwardsException if simulated time jumps back during the wait.
        """
        if nanoseconds(timeout) <= 0:
            return self.lookup_transform_core(target_frame, source_frame, time)
        try:
            return self.lookup_transform_core(target_frame, source_frame, time)
        except TransformException:
            self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

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

        ``fixed_frame`` is assumed not to move between the two times. Wait and raise exceptions like :meth:`lookup_transform`.
        """
        if nanoseconds(timeout) > 0:
            self.can_transform_full(
                target_frame, target_time, source_frame, source_time, fixed_frame, timeout
            )
        return self.lookup_transform_full_core(
            target_frame, target_time, source_frame, source_time, fixed_frame
        )

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Moment,
        timeout: Moment = NO_WAIT,
        return_debug_tuple: bool = False,
    ) -> int | tuple[int, str]:
        """Wait for a transform for at most ``timeout``. Return 1 if it is available, otherwise 0.

        If ``return_debug_tuple``, return a tuple of this result and the reason.

        Raise ROSInterruptException and ROSTimeMovedBackwardsException like :meth:`lookup_transform`.
        """

        def possible() -> tuple[int, str]:
            return self.can_transform_core(target_frame, source_frame, time)

        return self._wait_and_test(possible, timeout, return_debug_tuple)

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Moment,
        source_frame: str,
        source_time: Moment,
        fixed_frame: str,
        timeout: Moment = NO_WAIT,
        return_debug_tuple: bool = False,
    ) -> int | tuple[int, str]:
        """Wait for a transform between two times, like :meth:`can_transform`."""

        def possible() -> tuple[int, str]:
            return self.can_transform_full_core(
                target_frame, target_time, source_frame, source_time, fixed_frame
            )

        return self._wait_and_test(possible, timeout, return_debug_tuple)

    def _wait_and_test(
        self, possible: Callable[[], tuple[int, str]], timeout: Moment, return_debug_tuple: bool
    ) -> int | tuple[int, str]:
        if nanoseconds(timeout) > 0:
            wait_until(self, lambda: bool(possible()[0]), timeout, self.CAN_TRANSFORM_POLLING_SCALE)
        result = possible()
        if not result[0] and current_session().is_fork_without_node:
            current_session().report_fork("a tf2_ros.Buffer of the parent process")
        return result if return_debug_tuple else result[0]

    def _get_frames(self, request: FrameGraphRequest) -> FrameGraphResponse:
        return FrameGraphResponse(self.all_frames_as_yaml())
