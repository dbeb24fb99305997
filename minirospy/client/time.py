"""A node's time functions: Time, Duration, sleep, Rate and Timer, on wall or simulated time.

Source: http://wiki.ros.org/rospy/Overview/Time.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from minirospy.base import errors, times
from minirospy.base.clock import SignalSafeEvent, SimulatedClock
from minirospy.base.errors import ROSInitException
from minirospy.base.notes import noted
from minirospy.client.lifecycle import ROSInterruptException
from minirospy.client.session import current_session
from minirospy.runtime.transport.limits import naming_thread_limit

__all__ = [
    "Duration",
    "ROSTimeMovedBackwardsException",
    "Rate",
    "Time",
    "Timer",
    "TimerEvent",
    "get_rostime",
    "get_time",
    "is_wallclock",
    "sleep",
]

_log = logging.getLogger("rosout")

_NOT_INITIALIZED = "time is not initialized. Have you called init_node()?"


class ROSTimeMovedBackwardsException(errors.ROSTimeMovedBackwardsException, ROSInterruptException):
    """Simulated time jumped back during a sleep; it is now ``time`` seconds before the sleep's start.

    As in rospy, also a KeyboardInterrupt.
    """


class Duration(times.Duration):
    """A time span with the fields ``secs`` and ``nsecs``. It may be negative."""

    # Use rospy's module name, so that programs that use real rospy can load pickles made here, and vice versa.
    __module__ = "rospy.rostime"

    __slots__: list[str] = []

    def __repr__(self) -> str:
        return f"rospy.Duration[{self.to_nsec()}]"


class Time(times.Time):
    """A point in time with the fields ``secs`` and ``nsecs`` since the epoch."""

    __module__ = "rospy.rostime"

    __slots__: list[str] = []

    def __repr__(self) -> str:
        return f"rospy.Time[{self.to_nsec()}]"

    @staticmethod
    def now() -> Time:
        """Return the current time. Raise ROSInitException before init_node."""
        return get_rostime()

    @classmethod
    def from_seconds(cls, float_secs: float) -> Time:
        """Return the time at ``float_secs`` seconds. An older name for ``from_sec``."""
        return cls.from_sec(float_secs)


def get_rostime() -> Time:
    """Return the current time. Raise ROSInitException before init_node."""
    session = current_session()
    if not session.has_time:
        raise ROSInitException(_NOT_INITIALIZED)
    return _time(session.clock.now())


def get_time() -> float:
    """Return the current time in seconds. Raise ROSInitException before init_node."""
    session = current_session()
    if not session.has_time:
        raise ROSInitException(_NOT_INITIALIZED)
    return session.clock.now() / 1e9


def is_wallclock() -> bool:
    """Return whether the node uses the system time, as opposed to simulated time."""
    return not isinstance(current_session().clock, SimulatedClock)


def sleep(duration: float | times.Duration) -> None:
    """Sleep for ``duration`` seconds; return immediately if that is negative.

    If the node shuts down during the sleep, raise ROSInterruptException, or return early in a thread that polls is_shutdown().
    Raise ROSTimeMovedBackwardsException if simulated time jumps back to before the sleep started.
    """
    try:
        nanoseconds = duration.to_nsec() if isinstance(duration, times.Duration) else int(duration * 1e9)
    except TypeError as error:
        noted(error, "a duration is a number of seconds: rospy.sleep(0.5)")
        raise
    _sleep(nanoseconds)


class Rate:
    """Runs a loop at ``hz`` iterations per second. ``sleep()`` subtracts the time that the loop's own work took.

    ``last_time`` is the start of the current period, ``sleep_dur`` its length; a program may change either.
    """

    def __init__(self, hz: float, reset: bool = False) -> None:
        """Start the first period. ``reset``: start again, instead of raising, if simulated time jumps back.

        Raise ZeroDivisionError if the rate is 0, ROSInitException before init_node.
        """
        self.last_time = get_rostime()
        try:
            self.sleep_dur = Duration(0, int(1e9 / hz))
        except (ZeroDivisionError, TypeError) as error:
            noted(error, "a rate is a number of times per second: rospy.Rate(10)")
            raise
        self._reset = reset

    def remaining(self) -> Duration:
        """Return the remaining time of the current period."""
        return self._remaining(get_rostime())

    def sleep(self) -> None:
        """Sleep until the period is over. Raise the same exceptions as :func:`sleep`."""
        self._sleep(None)

    def _sleep(self, stop: threading.Event | None) -> None:
        """Sleep until the period is over, or ``stop`` is set."""
        now = current_session().clock.now()
        try:
            _sleep(self._left(now), stop)
        except ROSTimeMovedBackwardsException:
            if not self._reset:
                raise
            self.last_time = get_rostime()
            return
        period = self.sleep_dur.to_nsec()
        started = self.last_time.to_nsec() + period
        # If the loop is far behind, for example after a suspension, skip the missed periods.
        now = current_session().clock.now()
        self.last_time = _time(now if now - started > 2 * period else started)

    def _remaining(self, curr_time: times.Time) -> Duration:
        """Return the time left in this period at ``curr_time``.

        Subclasses in programs call this to sleep in a different way.
        """
        return Duration(0, self._left(curr_time.to_nsec()))

    def _left(self, now: int) -> int:
        if self.last_time.to_nsec() > now:
            # Time has jumped back, so start a new period.
            self.last_time = _time(now)
        return self.sleep_dur.to_nsec() - (now - self.last_time.to_nsec())


class TimerEvent:
    """The argument of a Timer's callback: the expected and actual times of this call and the previous one.

    ``last_duration`` is in seconds; in the first call the fields for the previous call are None.
    """

    def __init__(
        self,
        last_expected: times.Time | None,
        last_real: Time | None,
        current_expected: times.Time,
        current_real: Time,
        last_duration: float | None,
    ) -> None:
        self.last_expected = last_expected
        self.last_real = last_real
        self.current_expected = current_expected
        self.current_real = current_real
        self.last_duration = last_duration


class Timer(threading.Thread):
    """Calls ``callback(TimerEvent)`` every ``period`` (a Duration), or once with ``oneshot``, in its own thread.

    If simulated time jumps back, the period starts again, and the callback is called; without ``reset`` this is logged.
    An exception in the callback is logged, and the timer continues. ``sys.exit()`` in the callback stops the timer, and is
    logged too.
    """

    def __init__(
        self,
        period: times.Duration,
        callback: Callable[[TimerEvent], object],
        oneshot: bool = False,
        reset: bool = False,
    ) -> None:
        super().__init__(daemon=True)
        self._period = period
        self._callback = callback
        self._oneshot = oneshot
        self._reset = reset
        self._ended = SignalSafeEvent()
        with naming_thread_limit():
            self.start()

    @property
    def _shutdown(self) -> bool:
        """True if the timer was shut down. Programs read and set this attribute on rospy's Timer."""
        return self._ended.is_set()

    @_shutdown.setter
    def _shutdown(self, value: bool) -> None:
        if value:
            self._ended.set()

    def shutdown(self) -> None:
        """Stop calling the callback."""
        self._ended.set()

    def run(self) -> None:
        """Call the callback every period, in the timer's thread."""
        session = current_session()
        rate = Rate(1.0 / self._period.to_sec(), reset=self._reset)
        expected: times.Time = rate.last_time + self._period
        last_expected: times.Time | None = None
        last_real: Time | None = None
        last_duration: float | None = None

        with session.lifecycle.interrupting(self._ended.set):
            while not self._is_over():
                try:
                    rate._sleep(self._ended)
                except ROSTimeMovedBackwardsException as error:
                    _log.warning(
                        "simulated time jumped back by %.3f s: the Timer of %s starts its period again",
                        error.time,
                        self._callback,
                    )
                    rate.last_time = get_rostime()
                    expected = rate.last_time
                if self._is_over():
                    return

                real = get_rostime()
                start = time.perf_counter()
                try:
                    self._callback(TimerEvent(last_expected, last_real, expected, real, last_duration))
                except SystemExit as error:
                    # threading reports every exception except this one, and rospy's timer stops silently, so log it.
                    _log.error("Timer ends: its callback %s called sys.exit(%s)", self._callback, error)
                    return
                except BaseException as error:
                    # Stop if the callback is not callable, because the next call would fail, too.
                    # During a shutdown, ignore errors in the callback.
                    if not callable(self._callback) or session.lifecycle.is_shutdown_requested:
                        raise
                    session.callback_errors.log(self._callback, error)
                if self._oneshot:
                    return

                last_duration = time.perf_counter() - start
                last_expected, last_real = expected, real
                expected = expected + self._period

    def _is_over(self) -> bool:
        return self._ended.is_set() or current_session().is_shutdown()


def _sleep(nanoseconds: int, stop: threading.Event | None = None) -> None:
    """Sleep; return early if ``stop`` is set. Without ``stop``, a shutdown interrupts the sleep as in :func:`sleep`."""
    if nanoseconds <= 0:
        return
    session = current_session()
    if session.is_fork_without_node and isinstance(session.clock, SimulatedClock):
        # Only the parent process follows /clock, so a sleep here would never return.
        raise ROSInitException(session.why_fork_has_no_effect("simulated time"))
    lifecycle = session.lifecycle
    lifecycle.deferral.poll()
    lifecycle.has_waited = True
    end = stop or (SignalSafeEvent() if lifecycle.is_notified else lifecycle.shutting_down)

    try:
        is_over = session.clock.sleep(nanoseconds, end)
    except errors.ROSTimeMovedBackwardsException as error:
        raise ROSTimeMovedBackwardsException(error.time) from None

    lifecycle.deferral.poll()
    if not is_over and not stop:
        lifecycle.check_interrupted_sleep()


def _time(nanoseconds: int) -> Time:
    return Time(*divmod(nanoseconds, 1_000_000_000))
