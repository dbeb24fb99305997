"""rospy.rostime: the clock of the node, which a program may set."""

from __future__ import annotations

import threading
import time
from typing import Any

from minirospy.client.process import process
from minirospy.clock import SimulatedClock, WallClock
from minirospy.times import Time

__all__ = [
    "get_rostime_cond",
    "is_rostime_initialized",
    "is_wallclock",
    "set_rostime",
    "set_rostime_initialized",
    "switch_to_wallclock",
    "wallsleep",
]


def wallsleep(duration: float) -> None:
    """Sleep so many seconds of the wall clock, whatever the node's time is. Raises ValueError where negative."""
    time.sleep(duration)


def is_wallclock() -> bool:
    """Return whether the node's time is the machine's, not a simulated one."""
    return not isinstance(process.clock, SimulatedClock)


def get_rostime_cond() -> threading.Condition:
    """Return the condition that is notified of each simulated time."""
    return process.time_changed


def is_rostime_initialized() -> bool:
    """Return whether the time is available."""
    return process.has_time


def set_rostime_initialized(val: bool) -> None:
    """Make the time available, so that a program without a node can use Time.now()."""
    process.has_time = bool(val)


def set_rostime(t: Any) -> None:
    """Set the node's time, which is simulated from now on. Raises ValueError where ``t`` is not a Time."""
    if not isinstance(t, Time):
        raise ValueError(f"must be Time instance: {t.__class__}")
    clock = process.clock
    if not isinstance(clock, SimulatedClock):
        clock = process.clock = SimulatedClock(changed=process.time_changed)
    clock.set(t.to_nsec())


def switch_to_wallclock() -> None:
    """Use the machine's time from now on."""
    before, process.clock = process.clock, WallClock()
    if isinstance(before, SimulatedClock):
        # Wake the threads that sleep by it.
        before.set(process.clock.now())
    process.has_time = True
