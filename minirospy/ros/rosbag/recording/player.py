"""The node that plays bags: `rosbag play`. Messages are published as they were stored, never deserialized.

Source: http://wiki.ros.org/rosbag/Commandline#play.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

from minirospy.core.bag.base import StoredMessage
from minirospy.ros.rosbag.recording.output import NodeOutput, Output
from minirospy.ros.rosbag.recording.precise import PreciseWait
from minirospy.ros.rosbag.recording.schedule import PlayOptions, Schedule, State
from minirospy.ros.rosbag.recording.sources import Bags, ReadAhead, Selection

__all__ = ["Player", "PlayerState"]

_SECOND = 10**9
_TICK = _SECOND // 10
"""The status line is printed so often, and a shutdown noticed."""

_STALLED_SECONDS = 5.0
"""A subscriber that takes nothing for so long at the end is not waited for."""

_LEAD = _SECOND // 500
"""The first message is due so much later: the threads that start meanwhile do not delay it."""


class PlayerState(NamedTuple):
    """The state of a player: the bag's time in nanoseconds, and how fast that runs."""

    time: int
    rate: float
    is_paused: bool
    is_at_end: bool


class Player:
    """Plays bags: as this process's node, which init_node has made, unless there is another ``output``."""

    def __init__(
        self,
        bags: Bags,
        options: PlayOptions,
        on_ready: Callable[[int, int], object] | None = None,
        output: Output | None = None,
    ) -> None:
        """``on_ready(first, last)`` gets the times of what is to be played, before that starts.

        Its caller controls the player from then on by :meth:`control`: so the player stays at the end of the bags.
        """
        self.on_change: Callable[[], object] = lambda: None
        """Called in the player's thread when :meth:`state` has changed by itself: a message was published, the end reached."""
        self._output = output or NodeOutput(options)
        self._bags = bags
        self._options = options
        self._on_ready = on_ready
        self._span = (0, 0)
        self._seek_to: int | None = None
        self._starts_paused = options.paused
        self._is_started = False
        self._is_at_end = False
        self._is_fresh = True
        self._wait = PreciseWait()
        self._lock = threading.Lock()
        self._schedule: Schedule | None = None
        self._next_line = 0
        self._ended = False

    def run(self) -> int:
        """Play until the end, or until the node shuts down; return the exit status. Raise BagFormatError."""
        self._output.open(self)
        options = self._options
        times = self._bags.times()
        start = times[0] + options.start if times else 0
        end = start + options.duration if options.duration else None
        selection = Selection(options.topics, start if options.start else None, end)
        first = next(self._bags.messages(selection), None)
        if times is None or first is None:
            print("No messages to play on specified topics.  Exiting.", file=sys.stderr)
            return 0

        self._output.advertise(self._bags.connections(selection))
        if not options.quiet:
            self._say("")
        self._output.offer(self)
        last = self._bags.last_time(selection) if options.topics or end else times[1]
        latched = self._bags.last_latched(selection) if options.start else []
        self._span = first[1].time, last
        if self._on_ready:
            # Its clock does not advance until the playing starts.
            self._schedule = Schedule(options._replace(paused=True), *self._span, time.perf_counter_ns())
            self._on_ready(*self._span)
        # From here on the files are its thread's.
        messages = ReadAhead(self._bags.messages(selection))
        with contextlib.closing(messages):
            self._wait_before(latched)
            self._play_precisely(messages, selection, (first[1].time, last))
        self._wait_for_slow_subscribers()
        return 0

    def state(self) -> PlayerState:
        """Return where the player is. From any thread."""
        with self._lock:
            schedule = self._schedule
            if schedule is None:
                return PlayerState(self._span[0], self._options.rate, self._starts_paused, False)
            now = time.perf_counter_ns()
            is_paused = schedule.is_paused if self._is_started else self._starts_paused
            return PlayerState(schedule.status(now).time, schedule.rate, is_paused, self._is_at_end)

    def control(
        self,
        *,
        is_paused: bool | None = None,
        rate: float | None = None,
        seek: int | None = None,
        is_looping: bool | None = None,
        has_clock: bool | None = None,
    ) -> None:
        """Pause or go on, change the rate, go on at another time of the bag, start again at its end, show the clock.

        From any thread.
        """
        now = time.perf_counter_ns()
        with self._lock:
            if (schedule := self._schedule) is None:
                return
            if is_looping is not None:
                self._options = self._options._replace(loop=is_looping)
            if has_clock is not None and has_clock != self._options.clock:
                self._options = self._options._replace(clock=has_clock)
                schedule.set_clock(self._options.clock_hz if has_clock else 0.0, now)
            if rate is not None and rate != schedule.rate:
                schedule.set_rate(rate, now)
            if seek is not None:
                self._seek_to = min(max(seek, self._span[0]), self._span[1])
                self._is_fresh = True
                # What is shown until the files have been read from there.
                schedule.seek(self._seek_to, now)
            if is_paused is not None and not self._is_started:
                self._starts_paused = is_paused
            elif is_paused is not None:
                schedule.set_paused(is_paused, now)
            if self._is_at_end and is_paused is False and seek is None:
                self._seek_to = self._span[0]
            if self._seek_to is not None:
                self._is_at_end = False
        self._wait.wake()

    def step(self, count: int = 1) -> None:
        """Publish the next messages, if paused. From any thread."""
        with self._lock:
            for _ in range(count if self._schedule else 0):
                assert self._schedule
                self._schedule.step()
        self._wait.wake()

    @property
    def is_fresh(self) -> bool:
        """Return whether no message has been published since the start or the last seek."""
        return self._is_fresh

    @property
    def is_looping(self) -> bool:
        """Return whether it starts again at the end."""
        return self._options.loop

    def set_paused(self, paused: bool) -> bool:
        """Pause, or go on; return whether that changed anything. From any thread."""
        with self._lock:
            if self._schedule and self._is_started:
                changed = self._schedule.set_paused(paused, time.perf_counter_ns())
            else:
                changed = paused != self._starts_paused
                self._starts_paused = paused
        self._wait.wake()
        return changed

    def control_rate(self, stamp: int) -> None:
        """Store the stamp of the last message of the topic that controls the rate. From any thread."""
        with self._lock:
            if self._schedule:
                self._schedule.control_rate(stamp)
        self._wait.wake()

    def end(self) -> None:
        """Have :meth:`run` return. From any thread, and from the handler of a signal."""
        self._ended = True
        self._wait.wake()

    def _wait_before(self, latched: list[tuple[int, StoredMessage]]) -> None:
        """Wait for subscribers, as the options demand; publish what was latched before the start."""
        options = self._options
        self._say(f"Waiting {options.delay / 1e9:g} seconds after advertising topics...", end="")
        self._sleep(options.delay)
        self._say(" done.")
        self._say("\nHit space to toggle paused, or 's' to step.")

        for number, message in latched:
            self._publish(number, message)
        if options.wait_for_subscribers:
            self._wait_for_subscribers()

    def _play_precisely(self, messages: ReadAhead, selection: Selection, span: tuple[int, int]) -> None:
        """Play in the output's context."""
        messages.wait()
        # Before the keys are read: the first ones count.
        with self._lock:
            self._start(span)
        with self._output.running(self._on_key):
            self._play_all(messages, selection, span)

    def _start(self, span: tuple[int, int]) -> None:
        """Start the clock, with what was requested since the schedule was made."""
        now = time.perf_counter_ns()
        schedule, self._is_started = self._schedule, True
        if schedule is None:
            options = self._options._replace(paused=self._starts_paused)
            self._schedule = Schedule(options, *span, now + _LEAD)
        elif not self._starts_paused:
            schedule.set_paused(False, now)

    # --- playing

    def _wait_for_subscribers(self) -> None:
        self._say("Waiting for subscribers.")
        while not self._ended and not self._output.has_all_subscribers():
            self._sleep(_TICK // 10)
        if not self._ended:
            self._say("Finished waiting for subscribers.")

    def _play_all(self, messages: ReadAhead, selection: Selection, span: tuple[int, int]) -> None:
        while True:
            with contextlib.closing(messages):
                for number, message in messages:
                    if not self._play(message):
                        break
                    self._publish(number, message)
            if self._schedule and not self._ended and not self._options.quiet:
                # All of it has been played, however long ago the last line was.
                self._show_status(self._schedule, time.perf_counter_ns())
            if self._on_ready and not self._options.loop:
                self._wait_at_end()
            if (start := self._take_seek()) is not None and not self._ended:
                messages = self._read_from(start, messages, selection)
                continue
            if self._options.keep_alive:
                self._keep_alive()
            if self._ended:
                self._say("")
                return

            if not self._options.loop:
                self._say("\nDone.")
                return
            messages = ReadAhead(self._bags.messages(selection))
            messages.wait()
            with self._lock:
                if self._schedule and self._on_ready:
                    # With the rate that was set meanwhile.
                    self._schedule.seek(span[0], time.perf_counter_ns())
                else:
                    self._schedule = Schedule(self._options, *span, time.perf_counter_ns() + _LEAD)
            self.on_change()

    def _wait_for_slow_subscribers(self) -> None:
        """Wait while subscribers take what is left: it ends with this process."""
        left, end = 0, 0.0
        while not self._ended and (waiting := self._output.waiting_bytes()):
            now = time.monotonic()
            if waiting != left:
                left, end = waiting, now + _STALLED_SECONDS
            elif now > end:
                return
            self._sleep(_TICK // 10)

    def _wait_at_end(self) -> None:
        """Wait for a seek; the keys and the clock work as ever."""
        schedule = self._schedule
        assert schedule
        self._is_at_end = self._seek_to is None
        self.on_change()
        while not self._ended and self._seek_to is None and not self._options.loop:
            now = time.perf_counter_ns()
            self._tick(schedule, now)
            self._wait.until(now + _TICK)
        self._is_at_end = False

    def _take_seek(self) -> int | None:
        with self._lock:
            start, self._seek_to = self._seek_to, None
        return start

    def _read_from(self, start: int, messages: ReadAhead, selection: Selection) -> ReadAhead:
        """Return the messages from a time on, after publishing what was latched before."""
        messages.join()
        selection = selection._replace(start=start)
        for number, message in self._bags.last_latched(selection):
            self._publish(number, message)
        found = ReadAhead(self._bags.messages(selection))
        found.wait()
        with self._lock:
            if self._schedule and self._seek_to is None:
                # Steps that were requested meanwhile count.
                self._schedule.seek(start, time.perf_counter_ns(), keeps_steps=True)
        self.on_change()
        return found

    def _play(self, message: StoredMessage) -> bool:
        """Wait until a message is due; return False at a shutdown, and where another time is wanted."""
        schedule = self._schedule
        assert schedule
        now = time.perf_counter_ns()
        with self._lock:
            if self._seek_to is not None:
                return False
            schedule.offer(message.time, message.connection.topic, now)
        while not self._ended:
            self._tick(schedule, now)
            with self._lock:
                if self._seek_to is not None:
                    return False
                wait = schedule.poll(now)
                if wait is None:
                    # A client that sees the new time counts its steps from there.
                    self._is_fresh = False
            if wait is None:
                # At a step the clock shows the message's time first.
                self._tick(schedule, now)
                return True
            now = self._wait.until(min(wait, self._next_line) if not self._options.quiet else wait)
        return False

    def _keep_alive(self) -> None:
        schedule = self._schedule
        assert schedule
        while not self._ended:
            now = time.perf_counter_ns()
            with self._lock:
                wait = schedule.run_on(now)
            self._tick(schedule, now)
            self._wait.until(min(wait, now + _TICK))

    def _publish(self, number: int, message: StoredMessage) -> None:
        self._output.publish(number, message)
        self.on_change()

    def _tick(self, schedule: Schedule, now: int) -> None:
        """Publish the clock and print the status line, where it is time for that."""
        if self._options.clock:
            with self._lock:
                shown = schedule.tick(now)
            if shown is not None:
                self._output.publish_clock(shown)
        if now >= self._next_line and not self._options.quiet:
            self._next_line = now + _TICK
            self._show_status(schedule, now)

    def _show_status(self, schedule: Schedule, now: int) -> None:
        with self._lock:
            status = schedule.status(now)
        delay = f"Delay: {status.delay / 1e9:.2f} " if status.state is State.DELAYED else " " * 12
        self._say(
            f"\r [{status.state.value:7}]  Bag Time: {status.time / 1e9:13.6f}   "
            f"Duration: {status.played / 1e9:.6f} / {status.length / 1e9:.6f}   {delay}\r",
            end="",
        )

    # --- what comes from outside

    def _on_key(self, key: str) -> None:
        now = time.perf_counter_ns()
        with self._lock:
            if not (schedule := self._schedule):
                return
            if key == " ":
                schedule.set_paused(not schedule.is_paused, now)
            elif key == "s":
                schedule.step()
            elif key == "t":
                schedule.toggle_pause_topics()
        self._wait.wake()

    def _sleep(self, nanoseconds: int) -> None:
        end = time.perf_counter_ns() + nanoseconds
        while not self._ended and (now := time.perf_counter_ns()) < end:
            self._wait.until(min(end, now + _TICK))

    def _say(self, text: str, end: str = "\n") -> None:
        self._output.print(text, end)
