"""The node that plays bags: `rosbag play`. Messages are published as they were stored, never deserialized.

Source: http://wiki.ros.org/rosbag/Commandline#play.
"""

from __future__ import annotations

import contextlib
import gc
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, NamedTuple

from minirospy import client
from minirospy.bag.base import StoredMessage
from minirospy.bag.records import Connection
from minirospy.escape import SafeTerminal
from minirospy.recording.frames import ReceivedFrame, frame_class
from minirospy.recording.keys import read_keys
from minirospy.recording.precise import PreciseWait
from minirospy.recording.schedule import PlayOptions, Schedule, State
from minirospy.recording.sources import Bags, ReadAhead, Selection

if TYPE_CHECKING:
    from std_srvs.srv import SetBoolRequest, SetBoolResponse

__all__ = ["Player", "PlayerState"]

_SECOND = 10**9
_TICK = _SECOND // 10
"""The status line is printed so often, and a shutdown noticed."""

_SWITCH_SECONDS = 0.00005
"""How long the thread that reads ahead may keep the GIL when a message is due."""

_LEAD = _SECOND // 500
"""The first message is due so much later: the threads that start meanwhile do not delay it."""

_STAMP = struct.Struct("<4xII")
"""A message that starts with a Header: its sequence number, then the stamp."""

_CLOCK = struct.Struct("<II")


class _Outlet:
    """The messages of one publisher of the bag on a topic: the publisher of that topic sends them."""

    def __init__(self, publisher: client.Publisher[client.AnyMsg], is_latched: bool) -> None:
        self.publisher = publisher
        self.message = publisher.data_class()
        self.is_latched = is_latched
        self.last: bytes | None = None
        """The last message, if latched."""

    def publish(self, body: bytes) -> None:
        self.message._buff = body
        if self.is_latched:
            self.last = body
        self.publisher.publish(self.message)


class _LateSubscribers(client.SubscribeListener):
    """Gives a late subscriber the last message of each latched publisher of the bag: a topic itself keeps one only."""

    def __init__(self) -> None:
        self.outlets: list[_Outlet] = []

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None:
        latched = [outlet for outlet in self.outlets if outlet.last is not None]
        if len(latched) < 2:
            return
        for outlet in latched:
            message = outlet.publisher.data_class()
            message._buff = outlet.last
            peer_publish(message)


class PlayerState(NamedTuple):
    """The state of a player: the bag's time in nanoseconds, and how fast that runs."""

    time: int
    rate: float
    is_paused: bool
    is_at_end: bool


class Player:
    """Plays bags, as this process's node, which init_node has made."""

    def __init__(
        self, bags: Bags, options: PlayOptions, on_ready: Callable[[int, int], object] | None = None
    ) -> None:
        """``on_ready(first, last)`` gets the times of what is to be played, before that starts.

        Its caller controls the player from then on by :meth:`control`: so the player stays at the end of the bags.
        """
        self._bags = bags
        self._options = options
        self._on_ready = on_ready
        self._span = (0, 0)
        self._seek_to: int | None = None
        self._starts_paused = False
        self._is_started = False
        self._is_at_end = False
        self._publishers: dict[str, tuple[client.Publisher[client.AnyMsg], _LateSubscribers]] = {}
        self._outlets: dict[tuple[int, int], _Outlet | None] = {}
        self._wait = PreciseWait()
        self._lock = threading.Lock()
        self._schedule: Schedule | None = None
        self._clock: client.Publisher[client.AnyMsg] | None = None
        self._is_header_first: bool | None = None
        self._next_line = 0
        self._ended = False

    def run(self) -> int:
        """Play until the end, or until the node shuts down; return the exit status. Raise BagFormatError."""
        client.on_shutdown(self._end)
        options = self._options
        times = self._bags.times()
        start = times[0] + options.start if times else 0
        end = start + options.duration if options.duration else None
        selection = Selection(options.topics, start if options.start else None, end)
        first = next(self._bags.messages(selection), None)
        if times is None or first is None:
            print("No messages to play on specified topics.  Exiting.", file=sys.stderr)
            return 0

        self._clock = client.Publisher("clock", frame_class(*_clock_type()), queue_size=1)
        for number, connection in self._bags.connections(selection):
            self._advertise(number, connection)
        if not options.quiet:
            self._say("")
        self._offer_services()
        last = self._bags.last_time(selection) if options.topics or end else times[1]
        latched = self._bags.last_latched(selection) if options.start else []
        self._span = first[1].time, last
        if self._on_ready:
            # Its clock does not advance until the playing starts.
            self._schedule = Schedule(options._replace(paused=True), *self._span, time.perf_counter_ns())
            self._starts_paused = options.paused
            self._on_ready(*self._span)
        # From here on the files are its thread's.
        messages = ReadAhead(self._bags.messages(selection))
        with contextlib.closing(messages):
            self._wait_before(latched)
            self._play_precisely(messages, selection, (first[1].time, last))
        return 0

    def state(self) -> PlayerState:
        """Return where the player is. From any thread."""
        with self._lock:
            schedule = self._schedule
            if schedule is None:
                return PlayerState(self._span[0], self._options.rate, self._options.paused, False)
            now = time.perf_counter_ns()
            is_paused = schedule.is_paused if self._is_started else self._starts_paused
            return PlayerState(schedule.status(now).time, schedule.rate, is_paused, self._is_at_end)

    def control(
        self, *, is_paused: bool | None = None, rate: float | None = None, seek: int | None = None
    ) -> None:
        """Pause or go on, change the rate, go on at another time of the bag. From any thread."""
        now = time.perf_counter_ns()
        with self._lock:
            if (schedule := self._schedule) is None:
                return
            if rate is not None and rate != schedule.rate:
                schedule.set_rate(rate, now)
            if seek is not None:
                self._seek_to = min(max(seek, self._span[0]), self._span[1])
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
        """Play with what makes this process's threads switch soon, for as long as that lasts."""
        interval = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_SECONDS)
        # A collection that visits all that was imported takes milliseconds.
        gc.freeze()
        try:
            messages.wait()
            # Before the keys are read: the first ones count.
            with self._lock:
                self._start(span)
            with read_keys(self._on_key):
                self._play_all(messages, selection, span)
        finally:
            sys.setswitchinterval(interval)

    def _start(self, span: tuple[int, int]) -> None:
        """Start the clock, with what was requested since the schedule was made."""
        now = time.perf_counter_ns()
        schedule, self._is_started = self._schedule, True
        if schedule is None:
            self._schedule = Schedule(self._options, *span, now + _LEAD)
        elif not self._starts_paused:
            schedule.set_paused(False, now)

    # --- what it offers

    def _advertise(self, number: int, connection: Connection) -> None:
        topic = self._options.prefix + connection.topic
        known = self._publishers.get(topic)
        if known is None:
            late = _LateSubscribers()
            publisher = client.Publisher(
                topic,
                frame_class(connection.type, connection.md5sum, connection.definition),
                subscriber_listener=late,
                latch=connection.latching,
                queue_size=self._options.queue_size,
            )
            known = self._publishers[topic] = publisher, late

        publisher, late = known
        if publisher.md5sum != connection.md5sum:
            client.logerr(
                "Tried to advertise on topic [%s] with md5sum [%s] and datatype [%s], but the topic is already "
                "advertised as md5sum [%s] and datatype [%s]. These messages are left out",
                topic,
                connection.md5sum,
                connection.type,
                publisher.md5sum,
                publisher.type,
            )
            self._outlets[number, connection.id] = None
            return
        if connection.latching and publisher.impl:
            publisher.impl.enable_latch()
        outlet = self._outlets[number, connection.id] = _Outlet(publisher, connection.latching)
        late.outlets.append(outlet)

    def _offer_services(self) -> None:
        from std_srvs.srv import SetBool, SetBoolResponse

        def pause(request: SetBoolRequest) -> SetBoolResponse:
            with self._lock:
                changed = bool(
                    self._schedule and self._schedule.set_paused(request.data, time.perf_counter_ns())
                )
            self._wait.wake()
            if changed:
                return SetBoolResponse(True, "Playback is now " + ("paused" if request.data else "resumed"))
            return SetBoolResponse(False, "Bag is already " + ("paused." if request.data else "running."))

        client.Service("~pause_playback", SetBool, pause)
        if self._options.rate_control_topic:
            self._say("Creating rate control topic subscriber...", end="")
            client.Subscriber(self._options.rate_control_topic, ReceivedFrame, self._on_rate_control)
            self._say(" done.")

    def _wait_for_subscribers(self) -> None:
        self._say("Waiting for subscribers.")
        while not self._ended and any(
            not publisher.get_num_connections() for publisher, _ in self._publishers.values()
        ):
            self._sleep(_TICK // 10)
        if not self._ended:
            self._say("Finished waiting for subscribers.")

    # --- playing

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

    def _wait_at_end(self) -> None:
        """Wait for a seek; the keys and the clock work as ever."""
        schedule = self._schedule
        assert schedule
        self._is_at_end = self._seek_to is None
        while not self._ended and self._seek_to is None:
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
                self._schedule.seek(start, time.perf_counter_ns())
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
        outlet = self._outlets[number, message.connection.id]
        if outlet:
            outlet.publish(message.body)

    def _tick(self, schedule: Schedule, now: int) -> None:
        """Publish the clock and print the status line, where it is time for that."""
        if self._options.clock:
            with self._lock:
                shown = schedule.tick(now)
            if shown is not None and self._clock:
                message = self._clock.data_class()
                message._buff = _CLOCK.pack(*divmod(shown, _SECOND))
                self._clock.publish(message)
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

    def _on_rate_control(self, message: ReceivedFrame) -> None:
        if self._is_header_first is None:
            definition = message._connection_header.get("message_definition", "")
            self._is_header_first = _starts_with_header(definition)
        frame = message.frame
        if not self._is_header_first or len(frame) < _STAMP.size:
            print("\nWARNING: Rate control topic is bad, header is not first. MSG may be malformed.")
            return
        secs, nsecs = _STAMP.unpack_from(frame)
        with self._lock:
            if self._schedule:
                self._schedule.control_rate(secs * _SECOND + nsecs)
        self._wait.wake()

    def _end(self) -> None:
        self._ended = True
        self._wait.wake()

    def _sleep(self, nanoseconds: int) -> None:
        end = time.perf_counter_ns() + nanoseconds
        while not self._ended and (now := time.perf_counter_ns()) < end:
            self._wait.until(min(end, now + _TICK))

    def _say(self, text: str, end: str = "\n") -> None:
        with contextlib.suppress(OSError, ValueError):
            if text.startswith("\r") and isinstance(sys.stdout, SafeTerminal):
                # The status line, written again and again in its place.
                sys.stdout.write_own(text)
                text = ""
            print(text, end=end, flush=True)


def _clock_type() -> tuple[str, str, str]:
    from rosgraph_msgs.msg import Clock

    return Clock._type, Clock._md5sum, Clock._full_text


def _starts_with_header(definition: str) -> bool:
    lines: Iterable[str] = (line.strip() for line in definition.splitlines())
    first = next((line for line in lines if line and not line.startswith("#")), "")
    return first.startswith(("Header ", "std_msgs/Header "))
