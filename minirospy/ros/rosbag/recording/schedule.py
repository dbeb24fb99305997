"""The timing of `rosbag play`: computes when to publish each message, and the time for /clock. Pure: wall times are arguments.

All times are integers in nanoseconds: either bag time, or wall time from any monotonic clock.
Source: http://wiki.ros.org/rosbag/Commandline#play.
"""

from __future__ import annotations

import enum
from collections.abc import Collection
from typing import NamedTuple

__all__ = ["PlayOptions", "Schedule", "State", "Status"]

_SECOND = 10**9


class PlayOptions(NamedTuple):
    """The options of `rosbag play`. Times are in nanoseconds; positions in the bag are in bag time."""

    prefix: str = ""
    immediate: bool = False
    paused: bool = False
    queue_size: int = 100
    clock: bool = False
    clock_hz: float = 100.0
    delay: int = _SECOND // 5
    rate: float = 1.0
    start: int = 0
    duration: int = 0  # 0 means no limit
    skip_empty: int | None = None
    loop: bool = False
    keep_alive: bool = False
    topics: frozenset[str] = frozenset()  # empty means all topics
    pause_topics: frozenset[str] = frozenset()
    wait_for_subscribers: bool = False
    rate_control_topic: str = ""
    rate_control_max_delay: int = _SECOND
    quiet: bool = False


class State(enum.Enum):
    """A player's state."""

    RUNNING = "RUNNING"
    PAUSED = "PAUSED"
    DELAYED = "DELAYED"  # waiting for the rate control topic


class Status(NamedTuple):
    """The contents of the status line: the bag time and how much of the bag has been played."""

    state: State
    time: int
    played: int
    length: int
    delay: int  # lag of the rate control topic, in state DELAYED


class Schedule:
    """Computes when to publish each message.

    ``offer`` a message, call ``poll`` until it returns None, then publish the message.
    """

    def __init__(self, options: PlayOptions, first: int, last: int, wall: int) -> None:
        """Create a schedule. ``first`` and ``last`` are the first and last message's bag times.

        ``wall`` is the wall time when the first message is due.
        """
        self._options = options
        self._first = first
        self._last = last
        self._origin = wall  # wall time of bag time ``first``; each pause shifts it
        self._message = first
        self._is_due = False
        self._clock = first
        self._since = wall  # wall time at the start of the current pause or delay
        self._paused = options.paused
        self._steps = 0
        self._delayed = False
        self._pauses_at: Collection[str] = options.pause_topics
        self._controlled = first
        self._rate = options.rate
        self._next_tick = wall
        self._period = max(1, int(_SECOND / options.clock_hz)) if options.clock else 0

    @property
    def is_paused(self) -> bool:
        """Return whether playing is paused."""
        return self._paused

    @property
    def rate(self) -> float:
        """Return how fast bag time advances relative to wall time."""
        return self._rate

    def set_rate(self, rate: float, wall: int) -> None:
        """Change the rate, keeping the current bag time."""
        self._advance(wall)
        self._rate = rate
        self._start_from(self._clock, wall)

    def set_clock(self, hz: float, wall: int) -> None:
        """Set the rate of /clock messages in Hz; 0 disables them."""
        self._period = max(1, int(_SECOND / hz)) if hz else 0
        self._next_tick = wall

    def seek(self, time: int, wall: int, *, keeps_steps: bool = False) -> None:
        """Continue at another bag time; then call :meth:`offer` again. Drop the pending steps unless ``keeps_steps``."""
        self._clock = self._message = time
        self._is_due = False
        self._delayed = False
        self._steps = self._steps if keeps_steps else 0
        self._next_tick = wall
        self._start_from(time, wall)

    def offer(self, time: int, topic: str, wall: int) -> None:
        """Schedule the next message, given its bag time and topic, and the current wall time."""
        self._advance(wall)
        self._message = time
        options = self._options
        self._is_due = options.immediate
        if options.immediate:
            self._tick_now(wall)
        elif options.skip_empty is not None and time - self._clock > options.skip_empty:
            self._origin += wall - self._due()
            self._is_due = True
            self._tick_now(wall)
        else:
            if topic in self._pauses_at:
                self._stop(wall)
                self._paused = True
            if self._is_behind():
                self._stop(wall)
                self._delayed = True

    def poll(self, wall: int) -> int | None:
        """Return None if the message is due; otherwise return the wall time of the next poll.

        Poll earlier if another method is called before that.
        """
        if self._is_due:
            self._clock = self._message
            return None
        if self._paused and self._steps:
            self._steps -= 1
            self._origin += wall - self._due()
            self._since = wall
            self._tick_now(wall)
            return None
        if self._delayed and not self._paused and not self._is_behind():
            self._resume(wall)
            self._delayed = False

        self._advance(wall)
        if self._paused or self._delayed:
            wait = wall + _SECOND // 10
        elif (wait := self._due()) <= wall:
            self._clock = self._message
            return None
        return min(wait, self._next_tick) if self._period else wait

    def set_paused(self, paused: bool, wall: int) -> bool:
        """Pause or resume; return whether the state has changed."""
        if paused == self._paused:
            return False
        self._advance(wall)
        if paused:
            self._stop(wall)
        elif not self._delayed:
            self._resume(wall)
        self._paused = paused
        self._steps = 0
        return True

    def step(self) -> None:
        """If paused, make the current message due now. If there is none, do this with the next message offered."""
        if self._paused:
            self._steps += 1

    def toggle_pause_topics(self) -> None:
        """Toggle whether playback pauses at messages on the selected topics."""
        self._pauses_at = () if self._pauses_at else self._options.pause_topics

    def control_rate(self, stamp: int) -> None:
        """Store the timestamp of the last message on the rate control topic."""
        self._controlled = stamp

    def tick(self, wall: int) -> int | None:
        """Return the time to publish on /clock, or None if no /clock message is due."""
        if not self._period or wall < self._next_tick:
            return None
        self._advance(wall)
        # Skip messages that became due while the process was suspended, to avoid a burst.
        self._next_tick = max(self._next_tick + self._period, wall)
        return self._clock

    def status(self, wall: int) -> Status:
        """Return the contents of the status line."""
        self._advance(wall)
        state = State.PAUSED if self._paused else State.DELAYED if self._delayed else State.RUNNING
        behind = max(0, self._clock - self._controlled)
        return Status(state, self._clock, self._clock - self._first, self._last - self._first, behind)

    def run_on(self, wall: int) -> int:
        """For ``--keep-alive``, advance the clock past the last message; return the wall time of the next call."""
        if not (self._paused or self._delayed):
            self._clock = max(self._clock, self._bag_time(wall))
        wait = wall + _SECOND // 10
        return min(wait, self._next_tick) if self._period else wait

    def _due(self) -> int:
        """Return the wall time at which the message is due."""
        return self._origin + self._scaled(self._message - self._first, 1 / self._rate)

    def _bag_time(self, wall: int) -> int:
        return self._first + self._scaled(wall - self._origin, self._rate)

    def _scaled(self, span: int, factor: float) -> int:
        return span if self._rate == 1.0 else round(span * factor)

    def _start_from(self, time: int, wall: int) -> None:
        """Set the origin so that wall time ``wall`` corresponds to bag time ``time``."""
        self._origin = wall - self._scaled(time - self._first, 1 / self._rate)
        self._since = wall

    def _advance(self, wall: int) -> None:
        """Advance bag time, at most to the current message's time."""
        if not (self._paused or self._delayed):
            self._clock = max(self._clock, min(self._message, self._bag_time(wall)))

    def _stop(self, wall: int) -> None:
        if not (self._paused or self._delayed):
            self._since = wall

    def _resume(self, wall: int) -> None:
        self._origin += wall - self._since
        self._since = wall

    def _tick_now(self, wall: int) -> None:
        """Set bag time to the message's time and make a /clock message due now."""
        self._clock = self._message
        self._next_tick = wall

    def _is_behind(self) -> bool:
        options = self._options
        return bool(options.rate_control_topic) and (
            self._clock - self._controlled > options.rate_control_max_delay
        )
