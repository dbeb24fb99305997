"""Waits until an insertion provides a transform, or until a shutdown, the timeout, or a time jump."""

from __future__ import annotations

from collections.abc import Callable

from minirospy import client as rospy
from minirospy.base import times
from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.client.session import current_session
from minirospy.client.time import ROSTimeMovedBackwardsException
from minirospy.ros.tf2_ros.tf2_ros.core import BufferCore
from minirospy.ros.tf2_ros.tf2_ros.messages import Moment, nanoseconds

__all__ = ["wait_until"]

_JUMP = times.Duration(3)  # a wait continues if the wall clock is set back by at most this duration
# seconds between checks in simulated time: a change of that time does not wake a blocked thread
_SIMULATED_SLICE = 0.01


def wait_until(core: BufferCore, is_possible: Callable[[], bool], timeout: Moment, step: float) -> None:
    """Wait until ``is_possible()`` is true, or ``timeout`` in ROS time has passed. Check whenever a transform is inserted.

    ``step`` is the fraction of the timeout that the real implementation sleeps between checks. Raise
    ROSTimeMovedBackwardsException if simulated time jumps back to before the start of such a sleep, ROSInterruptException
    if the node shuts down in the meantime, ROSInitException if init_node has not been called.
    """
    start = slept = rospy.get_rostime()
    length = times.Duration(*divmod(nanoseconds(timeout), 1_000_000_000))
    end, pause = start + length, length * step
    changed = SignalSafeEvent()
    stop_listening = core.on_change(changed.set)

    try:
        with rospy.interrupting(changed.set):
            while not is_possible():
                if rospy.is_down():
                    raise current_session().lifecycle.interrupted("ROS shutdown request")
                now = rospy.get_rostime()
                is_simulated = not rospy.is_wallclock()
                if is_simulated and now < slept:
                    raise ROSTimeMovedBackwardsException((slept - now).to_sec())
                if now >= end or now + _JUMP < start:
                    return
                if now >= slept + pause:
                    slept = now
                rest = _SIMULATED_SLICE if is_simulated else (end - now).to_sec()
                wait_for_event(changed, rest)
                changed.clear()
    finally:
        stop_listening()
