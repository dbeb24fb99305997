"""`rosbag play` as a state machine: its state, and the effects of requests. Pure: wall times are arguments.

========= ============================================== ===================================================
phase     meaning                                        left for
========= ============================================== ===================================================
OPENING   bags are read, topics advertised; requests     READY by :meth:`Playback.accept_control`; PLAYING by
          other than a pause have no effect              :meth:`Playback.start`
READY     waiting for the delay and for subscribers; all PLAYING by :meth:`Playback.start`
          requests are accepted, and the clock is stopped
PLAYING   messages are offered and polled                AT_END by :meth:`Playback.reach_end`
AT_END    waiting after the last message                 PLAYING by a seek, by resuming, by
                                                         :meth:`Playback.leave_end`
========= ============================================== ===================================================

A seek takes two steps, because files must be read in between: a request sets the time and interrupts the messages; the reader
takes the request and reports when it has arrived. :mod:`minirospy.ros.rosbag.recording.player` is the impure part, with the
lock, the clock and the files.
"""

from __future__ import annotations

import enum
from typing import NamedTuple

from minirospy.ros.rosbag.recording.schedule import PlayOptions, Schedule, Status

__all__ = ["Phase", "Playback", "PlayerState"]

# Delay in ns before the first message, which would otherwise be late because threads are still starting.
_LEAD = 10**9 // 500


class Phase(enum.Enum):
    """A playback's phase; the module's docstring describes the transitions."""

    OPENING = enum.auto()
    READY = enum.auto()
    PLAYING = enum.auto()
    AT_END = enum.auto()


class PlayerState(NamedTuple):
    """A player's state: the bag time in nanoseconds, and the rate at which it advances."""

    time: int
    rate: float
    is_paused: bool
    is_at_end: bool


class Playback:
    """The playback's state machine. Only :meth:`end` is thread-safe; hold a lock when calling other methods."""

    def __init__(self, options: PlayOptions) -> None:
        self.phase = Phase.OPENING
        self.is_fresh = True  # whether no message has been published since the start or the last seek
        # set, without the lock, when a shutdown is requested; possible in any phase
        self.is_ended = False
        self.options = options  # control() replaces the options for looping and /clock
        self.seek_to: int | None = None  # bag time of a requested seek; None once the reader has taken it
        self._span = (0, 0)  # bag times of the first and last message; set in OPENING
        self._starts_paused = options.paused  # whether to start paused; read before PLAYING
        self._schedule: Schedule | None = None  # None in OPENING

    # --- transitions

    def set_span(self, first: int, last: int) -> None:
        """Store the bag times of the first and last message. Called in OPENING."""
        self._span = first, last

    def accept_control(self, wall: int) -> None:
        """Enter READY, in which seeks and other requests take effect."""
        self.phase = Phase.READY
        # Start paused: the schedule's clock must not advance until playing starts.
        self._schedule = Schedule(self.options._replace(paused=True), *self._span, wall)

    def start(self, wall: int) -> None:
        """Enter PLAYING and apply earlier requests."""
        self.phase = Phase.PLAYING
        if self._schedule is None:
            options = self.options._replace(paused=self._starts_paused)
            self._schedule = Schedule(options, *self._span, wall + _LEAD)
        elif not self._starts_paused:
            self._schedule.set_paused(False, wall)

    def restart(self, wall: int, *, keeps_schedule: bool) -> None:
        """Return to the first message, for ``--loop``. If ``keeps_schedule``, keep the current rate."""
        if keeps_schedule:
            self._running.seek(self._span[0], wall)
        else:
            self._schedule = Schedule(self.options, *self._span, wall + _LEAD)

    def reach_end(self) -> None:
        """Enter AT_END, unless a seek has been requested."""
        if self.seek_to is None:
            self.phase = Phase.AT_END

    def leave_end(self) -> None:
        """Enter PLAYING again after :attr:`stays_at_end` has become False."""
        self.phase = Phase.PLAYING

    def end(self) -> None:
        """Stop playing. Safe to call from any thread or signal handler."""
        self.is_ended = True

    # --- requests

    def control(
        self,
        wall: int,
        *,
        is_paused: bool | None = None,
        rate: float | None = None,
        seek: int | None = None,
        is_looping: bool | None = None,
        has_clock: bool | None = None,
    ) -> None:
        """Pause or resume, set the rate, seek to a bag time, loop, or publish /clock. None leaves a setting unchanged.

        Resuming at the end without a seek returns to the first message.
        """
        if (schedule := self._schedule) is None:
            return
        if is_looping is not None:
            self.options = self.options._replace(loop=is_looping)
        if has_clock is not None and has_clock != self.options.clock:
            self.options = self.options._replace(clock=has_clock)
            schedule.set_clock(self.options.clock_hz if has_clock else 0.0, wall)
        if rate is not None and rate != schedule.rate:
            schedule.set_rate(rate, wall)
        if seek is not None:
            self.seek_to = min(max(seek, self._span[0]), self._span[1])
            self.is_fresh = True
            # state() reports the requested time until the reader has reached it in the files.
            schedule.seek(self.seek_to, wall)
        if is_paused is not None:
            self.set_paused(is_paused, wall)
        if self.phase is Phase.AT_END:
            if is_paused is False and seek is None:
                self.seek_to = self._span[0]
            if self.seek_to is not None:
                self.phase = Phase.PLAYING

    def set_paused(self, paused: bool, wall: int) -> bool:
        """Pause or resume; return whether the state has changed."""
        if self._is_started:
            return self._running.set_paused(paused, wall)
        changed = paused != self._starts_paused
        self._starts_paused = paused
        return changed

    def press(self, key: str, wall: int) -> None:
        """Perform a key's command: space toggles pausing, s steps, t toggles pausing at the selected topics."""
        if not (schedule := self._schedule):
            return
        if key == " ":
            schedule.set_paused(not schedule.is_paused, wall)
        elif key == "s":
            schedule.step()
        elif key == "t":
            schedule.toggle_pause_topics()

    def step(self, count: int) -> None:
        """Publish the next ``count`` messages, if paused."""
        for _ in range(count if self._schedule else 0):
            self._running.step()

    def control_rate(self, stamp: int) -> None:
        """Store the timestamp of the last message on the rate control topic."""
        if self._schedule:
            self._schedule.control_rate(stamp)

    # --- messages

    def take_seek(self) -> int | None:
        """Return and clear the requested bag time; return None if no seek is requested."""
        start, self.seek_to = self.seek_to, None
        return start

    def arrive(self, start: int, wall: int) -> None:
        """Continue at ``start``, which the reader has reached, unless another seek has been requested since."""
        if self.seek_to is None:
            # Keep the steps requested in the meantime.
            self._running.seek(start, wall, keeps_steps=True)

    def offer(self, time: int, topic: str, wall: int) -> None:
        """See :meth:`Schedule.offer`."""
        schedule = self._schedule
        assert schedule
        schedule.offer(time, topic, wall)

    def poll(self, wall: int) -> int | None:
        """See :meth:`Schedule.poll`."""
        schedule = self._schedule
        assert schedule
        wait = schedule.poll(wall)
        if wait is None:
            # poll() has advanced the time, so clear is_fresh, too: clients read both to count the messages of a step.
            self.is_fresh = False
        return wait

    def tick(self, wall: int) -> int | None:
        """See :meth:`Schedule.tick`."""
        return self._running.tick(wall)

    def run_on(self, wall: int) -> int:
        """See :meth:`Schedule.run_on`."""
        return self._running.run_on(wall)

    # --- state

    def state(self, wall: int) -> PlayerState:
        """Return the player's state at the wall time ``wall``."""
        schedule = self._schedule
        if schedule is None:
            return PlayerState(self._span[0], self.options.rate, self._starts_paused, False)
        is_paused = schedule.is_paused if self._is_started else self._starts_paused
        return PlayerState(schedule.status(wall).time, schedule.rate, is_paused, self.phase is Phase.AT_END)

    def status(self, wall: int) -> Status:
        """See :meth:`Schedule.status`."""
        return self._running.status(wall)

    @property
    def stays_at_end(self) -> bool:
        """Return whether the player must keep waiting after the last message."""
        return not self.is_ended and self.seek_to is None and not self.options.loop

    @property
    def _is_started(self) -> bool:
        return self.phase in (Phase.PLAYING, Phase.AT_END)

    @property
    def _running(self) -> Schedule:
        assert self._schedule
        return self._schedule
