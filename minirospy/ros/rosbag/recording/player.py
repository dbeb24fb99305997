"""The node that plays bags: `rosbag play`. Messages are published as stored, without deserializing.

Source: http://wiki.ros.org/rosbag/Commandline#play.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable

from minirospy.core.bag.base import StoredMessage
from minirospy.ros.rosbag.recording.output import NodeOutput, Output
from minirospy.ros.rosbag.recording.playback import Playback, PlayerState
from minirospy.ros.rosbag.recording.precise import PreciseWait
from minirospy.ros.rosbag.recording.schedule import PlayOptions, State
from minirospy.ros.rosbag.recording.sources import Bags, ReadAhead, Selection

__all__ = ["Player"]

_SECOND = 10**9
_TICK = _SECOND // 10  # ns between status lines, and between shutdown checks

# Seconds to wait at the end for a subscriber that is not reading.
_STALLED_SECONDS = 5.0


class Player:
    """Plays bags through this process's node (call init_node() first), or through another ``output``.

    A :class:`Playback` decides what requests do; this class provides the lock, the time and the messages.
    """

    def __init__(
        self,
        bags: Bags,
        options: PlayOptions,
        on_ready: Callable[[int, int], object] | None = None,
        output: Output | None = None,
    ) -> None:
        """Create a player. Before playing, the player calls ``on_ready`` with the times of the first and the last message.

        From then on the player can be controlled with :meth:`control`, so it waits at the end of the bags instead of
        returning.
        """
        self.on_change: Callable[[], object] = lambda: None
        """Called in the player's thread when :meth:`state` changes without a request: after each message, and at the end."""
        self._output = output or NodeOutput(options)
        self._bags = bags
        self._options = options
        self._on_ready = on_ready
        self._playback = Playback(options)
        self._lock = threading.Lock()
        self._wait = PreciseWait()
        self._next_line = 0  # wall time of the next status line

    def run(self) -> int:
        """Play until the end or until the node shuts down; return the exit status. Raise BagFormatError if a bag is damaged."""
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
        self._playback.set_span(first[1].time, last)
        if self._on_ready:
            with self._lock:
                self._playback.accept_control(time.perf_counter_ns())
            self._on_ready(first[1].time, last)
        # From here on, only the reading thread may use the files.
        messages = ReadAhead(self._bags.messages(selection))
        with contextlib.closing(messages):
            self._wait_before(latched)
            self._play_precisely(messages, selection)
        self._wait_for_slow_subscribers()
        return 0

    def state(self) -> PlayerState:
        """Return the player's state. Thread-safe."""
        with self._lock:
            return self._playback.state(time.perf_counter_ns())

    def control(
        self,
        *,
        is_paused: bool | None = None,
        rate: float | None = None,
        seek: int | None = None,
        is_looping: bool | None = None,
        has_clock: bool | None = None,
    ) -> None:
        """Pause or resume, set the rate, seek to a bag time, loop, or publish /clock. None leaves a setting unchanged.

        Thread-safe.
        """
        with self._lock:
            self._playback.control(
                time.perf_counter_ns(),
                is_paused=is_paused,
                rate=rate,
                seek=seek,
                is_looping=is_looping,
                has_clock=has_clock,
            )
        self._wait.wake()

    def step(self, count: int = 1) -> None:
        """Publish the next ``count`` messages, if paused. Thread-safe."""
        with self._lock:
            self._playback.step(count)
        self._wait.wake()

    @property
    def is_fresh(self) -> bool:
        """Return whether no message has been published since the start or the last seek."""
        return self._playback.is_fresh

    @property
    def is_looping(self) -> bool:
        """Return whether playback restarts when it reaches the end."""
        return self._playback.options.loop

    def set_paused(self, paused: bool) -> bool:
        """Pause or resume; return whether the state has changed. Thread-safe."""
        with self._lock:
            changed = self._playback.set_paused(paused, time.perf_counter_ns())
        self._wait.wake()
        return changed

    def control_rate(self, stamp: int) -> None:
        """Store the timestamp of the last message on the rate control topic. Thread-safe."""
        with self._lock:
            self._playback.control_rate(stamp)
        self._wait.wake()

    def end(self) -> None:
        """Make :meth:`run` return. Safe to call from any thread or signal handler."""
        self._playback.end()
        self._wait.wake()

    def _wait_before(self, latched: list[tuple[int, StoredMessage]]) -> None:
        """Wait for the delay in the options, publish the latched messages from before the start, then wait for subscribers."""
        options = self._options
        self._say(f"Waiting {options.delay / 1e9:g} seconds after advertising topics...", end="")
        self._sleep(options.delay)
        self._say(" done.")
        self._say("\nHit space to toggle paused, or 's' to step.")

        for number, message in latched:
            self._publish(number, message)
        if options.wait_for_subscribers:
            self._wait_for_subscribers()

    def _play_precisely(self, messages: ReadAhead, selection: Selection) -> None:
        """Play all messages inside the output's context manager."""
        messages.wait()
        # Start the schedule before reading keys, so that the first keys have an effect.
        with self._lock:
            self._playback.start(time.perf_counter_ns())
        with self._output.running(self._on_key):
            self._play_all(messages, selection)

    # --- playing

    def _wait_for_subscribers(self) -> None:
        self._say("Waiting for subscribers.")
        while not self._playback.is_ended and not self._output.has_all_subscribers():
            self._sleep(_TICK // 10)
        if not self._playback.is_ended:
            self._say("Finished waiting for subscribers.")

    def _play_all(self, messages: ReadAhead, selection: Selection) -> None:
        while True:
            with contextlib.closing(messages):
                for number, message in messages:
                    if not self._play(message):
                        break
                    self._publish(number, message)
            if not self._playback.is_ended and not self._options.quiet:
                # Show the final state, even right after another status line.
                self._show_status(time.perf_counter_ns())
            if self._on_ready and not self.is_looping:
                self._wait_at_end()
            with self._lock:
                start = self._playback.take_seek()
            if start is not None and not self._playback.is_ended:
                messages = self._read_from(start, messages, selection)
                continue
            if self._options.keep_alive:
                self._keep_alive()
            if self._playback.is_ended:
                self._say("")
                return

            if not self.is_looping:
                self._say("\nDone.")
                return
            messages = ReadAhead(self._bags.messages(selection))
            messages.wait()
            with self._lock:
                self._playback.restart(time.perf_counter_ns(), keeps_schedule=self._on_ready is not None)
            self.on_change()

    def _wait_for_slow_subscribers(self) -> None:
        """Wait until subscribers have read the queued messages, which would be lost when this process exits."""
        left, end = 0, 0.0
        while not self._playback.is_ended and (waiting := self._output.waiting_bytes()):
            now = time.monotonic()
            if waiting != left:
                left, end = waiting, now + _STALLED_SECONDS
            elif now > end:
                return
            self._sleep(_TICK // 10)

    def _wait_at_end(self) -> None:
        """At the end, wait for a seek or looping, while keys and /clock keep working."""
        with self._lock:
            self._playback.reach_end()
        self.on_change()
        while self._playback.stays_at_end:
            now = time.perf_counter_ns()
            self._tick(now)
            self._wait.until(now + _TICK)
        with self._lock:
            self._playback.leave_end()

    def _read_from(self, start: int, messages: ReadAhead, selection: Selection) -> ReadAhead:
        """Return the messages from ``start`` on, after publishing each latched topic's last earlier message."""
        messages.join()
        selection = selection._replace(start=start)
        for number, message in self._bags.last_latched(selection):
            self._publish(number, message)
        found = ReadAhead(self._bags.messages(selection))
        found.wait()
        with self._lock:
            self._playback.arrive(start, time.perf_counter_ns())
        self.on_change()
        return found

    def _play(self, message: StoredMessage) -> bool:
        """Wait until a message is due and return True, or return False at shutdown or on a seek request."""
        playback = self._playback
        now = time.perf_counter_ns()
        with self._lock:
            if playback.seek_to is not None:
                return False
            playback.offer(message.time, message.connection.topic, now)
        while not playback.is_ended:
            self._tick(now)
            with self._lock:
                if playback.seek_to is not None:
                    return False
                wait = playback.poll(now)
            if wait is None:
                # When stepping, publish the message's time on /clock first.
                self._tick(now)
                return True
            now = self._wait.until(min(wait, self._next_line) if not self._options.quiet else wait)
        return False

    def _keep_alive(self) -> None:
        while not self._playback.is_ended:
            now = time.perf_counter_ns()
            with self._lock:
                wait = self._playback.run_on(now)
            self._tick(now)
            self._wait.until(min(wait, now + _TICK))

    def _publish(self, number: int, message: StoredMessage) -> None:
        self._output.publish(number, message)
        self.on_change()

    def _tick(self, now: int) -> None:
        """Publish /clock and print the status line if they are due."""
        if self._playback.options.clock:
            with self._lock:
                shown = self._playback.tick(now)
            if shown is not None:
                self._output.publish_clock(shown)
        if now >= self._next_line and not self._options.quiet:
            self._next_line = now + _TICK
            self._show_status(now)

    def _show_status(self, now: int) -> None:
        with self._lock:
            status = self._playback.status(now)
        delay = f"Delay: {status.delay / 1e9:.2f} " if status.state is State.DELAYED else " " * 12
        self._say(
            f"\r [{status.state.value:7}]  Bag Time: {status.time / 1e9:13.6f}   "
            f"Duration: {status.played / 1e9:.6f} / {status.length / 1e9:.6f}   {delay}\r",
            end="",
        )

    # --- callbacks

    def _on_key(self, key: str) -> None:
        with self._lock:
            self._playback.press(key, time.perf_counter_ns())
        self._wait.wake()

    def _sleep(self, nanoseconds: int) -> None:
        end = time.perf_counter_ns() + nanoseconds
        while not self._playback.is_ended and (now := time.perf_counter_ns()) < end:
            self._wait.until(min(end, now + _TICK))

    def _say(self, text: str, end: str = "\n") -> None:
        self._output.print(text, end)
