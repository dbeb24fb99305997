"""Blocks until a condition becomes true, without polling. A shutdown interrupts the wait. Timeouts are in ROS time."""

from __future__ import annotations

import threading
from collections.abc import Callable

from minirospy import client as rospy
from minirospy.base import times
from minirospy.base.clock import SignalSafeEvent, wait_for_event

__all__ = ["Waiting"]

_FOREVER = times.Duration()
# polling interval in seconds in simulated time, which may run faster than real time
_SIMULATED_SLICE = 0.02


class Waiting:
    """Wakes threads that wait for a condition; call :meth:`notify` when the condition may have become true."""

    def __init__(self) -> None:
        self._events: list[threading.Event] = []

    def notify(self) -> None:
        """Make all waiting threads check their conditions again."""
        for event in list(self._events):
            event.set()

    def wait_for(self, condition: Callable[[], bool], timeout: times.Duration) -> bool:
        """Wait until ``condition()`` is true; return False after ``timeout`` (zero: no timeout) or at a shutdown."""
        deadline = rospy.get_rostime() + timeout if timeout != _FOREVER else None
        if condition():
            return True
        event = SignalSafeEvent()
        self._events.append(event)

        try:
            with rospy.interrupting(event.set):
                while not condition() and not rospy.is_down():
                    seconds = None
                    if deadline is not None:
                        seconds = (deadline - rospy.get_rostime()).to_sec()
                        if seconds <= 0:
                            break
                        if not rospy.is_wallclock():
                            seconds = _SIMULATED_SLICE
                    wait_for_event(event, seconds)
                    event.clear()
        finally:
            self._events.remove(event)

        return condition()
