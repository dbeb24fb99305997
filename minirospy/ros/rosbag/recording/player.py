"""The node that plays bags: `rosbag play`. Messages are published as stored, without deserializing.

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
_TICK = _SECOND // 10  # ns; interval of the status line and of shutdown checks

_STALLED_SECONDS = 5.0  # at the end, give up on a subscriber that has read nothing for this long

_LEAD = _SECOND // 500  # ns; delay of the first message, so that starting threads do not make it late


class PlayerState(NamedTuple):
    """The state of a player: the bag time in nanoseconds, and the rate at which it advances."""

    time: int
    rate: float
    is_paused: bool
    is_at_end: bool


class Player:
    """Plays bags on this process's node (init_node has been called), or on another ``output``."""

    def __init__(
        self,
        bags: Bags,
        options: PlayOptions,
        on_ready: Callable[[int, int], object] | None = None,
        output: Output | None = None,
    ) -> None:
        """``on_ready(first, last)`` is called before playing starts, with the times of the first and last message.

        From then on the player can be controlled with :meth:`control`, so it waits at the end of the bags instead of
        returning.
        """
        self.on_change: Callable[[], object] = lambda: None
        """Called in the player's thread when :meth:`state` changes by itself: after each message, and at the end."""
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
            # A paused schedule: its clock must not advance until playing starts.
            self._schedule = Schedule(options._replace(paused=True), *self._span, time.perf_counter_ns())
            self._on_ready(*self._span)
        # From here on only the reading thread uses the files.
        messages = ReadAhead(self._bags.messages(selection))
        with contextlib.closing(messages):
            self._wait_before(latched)
            self._play_precisely(messages, selection, (first[1].time, last))
        self._wait_for_slow_subscribers()
        return 0

    def state(self) -> PlayerState:
        """Return the state of the player. Thread-safe."""
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
        """Pause or resume, set the rate, seek to a time in the bag, loop, or publish /clock. None leaves a setting as it is.

        Thread-safe.
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
                # state() reports this time until the files have been read from there.
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
        """Publish the next ``count`` messages, if paused. Thread-safe."""
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
        """Return whether playing restarts at the end."""
        return self._options.loop

    def set_paused(self, paused: bool) -> bool:
        """Pause or resume; return whether that changed the state. Thread-safe."""
        with self._lock:
            if self._schedule and self._is_started:
                changed = self._schedule.set_paused(paused, time.perf_counter_ns())
            else:
                changed = paused != self._starts_paused
                self._starts_paused = paused
        self._wait.wake()
        return changed

    def control_rate(self, stamp: int) -> None:
        """Store the stamp of the last message on the rate control topic. Thread-safe."""
        with self._lock:
            if self._schedule:
                self._schedule.control_rate(stamp)
        self._wait.wake()

    def end(self) -> None:
        """Make :meth:`run` return. Safe in any thread and in signal handlers."""
        self._ended = True
        self._wait.wake()

    def _wait_before(self, latched: list[tuple[int, StoredMessage]]) -> None:
        """Wait for the delay and for subscribers, as the options require; publish messages latched before the start."""
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
        """Play all messages in the output's context."""
        messages.wait()
        # Start the schedule before the keys are read, so that the first keys have an effect.
        with self._lock:
            self._start(span)
        with self._output.running(self._on_key):
            self._play_all(messages, selection, span)

    def _start(self, span: tuple[int, int]) -> None:
        """Start the clock, applying the requests made since the schedule was created."""
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
                # Show the final state, even if the last status line was printed a moment ago.
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
                    # Keep the schedule: its rate may have been changed.
                    self._schedule.seek(span[0], time.perf_counter_ns())
                else:
                    self._schedule = Schedule(self._options, *span, time.perf_counter_ns() + _LEAD)
            self.on_change()

    def _wait_for_slow_subscribers(self) -> None:
        """Wait while subscribers read the queued messages, which are lost when this process exits."""
        left, end = 0, 0.0
        while not self._ended and (waiting := self._output.waiting_bytes()):
            now = time.monotonic()
            if waiting != left:
                left, end = waiting, now + _STALLED_SECONDS
            elif now > end:
                return
            self._sleep(_TICK // 10)

    def _wait_at_end(self) -> None:
        """Wait at the end for a seek or looping; keys and /clock keep working."""
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
        """Return the messages from ``start`` on; first publish those that were latched before it."""
        messages.join()
        selection = selection._replace(start=start)
        for number, message in self._bags.last_latched(selection):
            self._publish(number, message)
        found = ReadAhead(self._bags.messages(selection))
        found.wait()
        with self._lock:
            if self._schedule and self._seek_to is None:
                # Keep the steps that were requested meanwhile.
                self._schedule.seek(start, time.perf_counter_ns(), keeps_steps=True)
        self.on_change()
        return found

    def _play(self, message: StoredMessage) -> bool:
        """Wait until a message is due and return True; return False at shutdown or if a seek is requested."""
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
                    # Set together with the new time: a client that sees this time counts its steps from here.
                    self._is_fresh = False
            if wait is None:
                # When stepping, /clock shows the message's time before the message is published.
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
        """Publish /clock and print the status line if they are due."""
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
