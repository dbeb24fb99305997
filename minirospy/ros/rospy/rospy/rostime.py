"""rospy.rostime: the node's clock, which programs can set."""

from __future__ import annotations

import threading
import time

from minirospy.base import times
from minirospy.base.clock import SimulatedClock, WallClock
from minirospy.client.session import current_session
from minirospy.client.time import Duration, Time, get_rostime, get_time, is_wallclock

__all__ = [
    "Duration",
    "Time",
    "_set_rostime",
    "get_rostime",
    "get_rostime_cond",
    "get_time",
    "is_rostime_initialized",
    "is_wallclock",
    "set_rostime_initialized",
    "switch_to_wallclock",
    "wallsleep",
]


def wallsleep(duration: float) -> None:
    """Sleep for ``duration`` seconds of wall time, even if the node's time is simulated.

    Raise ValueError if ``duration`` is negative.
    """
    time.sleep(duration)


def get_rostime_cond() -> threading.Condition:
    """Return the condition that is notified of changes in simulated time."""
    return current_session().time_changed


def is_rostime_initialized() -> bool:
    """Return whether the node's time is available."""
    return current_session().has_time


def set_rostime_initialized(val: bool) -> None:
    """Mark the time as available, so that a program without a node can call Time.now()."""
    current_session().has_time = bool(val)


def set_rostime(t: object) -> None:
    """Switch the node to simulated time and set the time. Raise ValueError if ``t`` is not a Time."""
    if not isinstance(t, times.Time):
        raise ValueError(f"must be Time instance: {t.__class__}")
    session = current_session()
    clock = session.clock
    if not isinstance(clock, SimulatedClock):
        clock = session.clock = SimulatedClock(changed=session.time_changed)
    clock.set(t.to_nsec())


_set_rostime = set_rostime


def switch_to_wallclock() -> None:
    """Switch the node to the system clock."""
    session = current_session()
    before, session.clock = session.clock, WallClock()
    if isinstance(before, SimulatedClock):
        # Wake the threads sleeping on the previous clock.
        before.set(session.clock.now())
    session.has_time = True
