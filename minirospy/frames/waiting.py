"""Waiting for a transform: until an insertion, a shutdown, the timeout, or a jump of time."""

from __future__ import annotations

from collections.abc import Callable

from minirospy import client as rospy
from minirospy import times
from minirospy.client.session import current_session
from minirospy.clock import SignalSafeEvent, wait_for_event
from minirospy.frames.core import BufferCore
from minirospy.frames.messages import Moment, nanoseconds

__all__ = ["wait_until"]

_JUMP = times.Duration(3)
"""A time that goes back by more ends a wait: a bag file that starts again."""
_SIMULATED_SLICE = 0.01
"""Seconds. Nothing notifies a waiting thread of simulated time."""


def wait_until(core: BufferCore, is_possible: Callable[[], bool], timeout: Moment) -> None:
    """Return when ``is_possible()``, looked at after each insertion, or after ``timeout`` of ROS time.

    Raise ROSInterruptException where the node shuts down meanwhile, ROSInitException before init_node.
    """
    start = rospy.get_rostime()
    end = start + times.Duration(*divmod(nanoseconds(timeout), 1_000_000_000))
    changed = SignalSafeEvent()
    stop_listening = core.on_change(changed.set)

    try:
        with rospy.interrupting(changed.set):
            while not is_possible():
                if rospy.is_down():
                    raise current_session().lifecycle.interrupted("ROS shutdown request")
                now = rospy.get_rostime()
                if now >= end or now + _JUMP < start:
                    return
                rest = (end - now).to_sec() if rospy.is_wallclock() else _SIMULATED_SLICE
                wait_for_event(changed, rest)
                changed.clear()
    finally:
        stop_listening()
