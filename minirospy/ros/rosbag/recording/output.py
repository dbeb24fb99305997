"""A player's output: this process's node for `rosbag play`, or another output for players inside programs."""

from __future__ import annotations

import contextlib
import gc
import struct
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Protocol

from minirospy import client
from minirospy.base.escape import SafeTerminal
from minirospy.core.bag.base import StoredMessage
from minirospy.core.bag.records import Connection
from minirospy.ros.rosbag.recording.frames import ReceivedFrame, frame_class
from minirospy.ros.rosbag.recording.keys import read_keys
from minirospy.ros.rosbag.recording.schedule import PlayOptions

if TYPE_CHECKING:
    from std_srvs.srv import SetBoolRequest, SetBoolResponse

__all__ = ["CLOCK", "Controls", "NodeOutput", "Output"]

_SECOND = 10**9
# GIL switch interval in seconds: the longest time by which the reading thread can delay a due message.
_SWITCH_SECONDS = 0.00005

_STAMP = struct.Struct("<4xII")  # start of a Header: sequence number (skipped), then timestamp

CLOCK = struct.Struct("<II")  # serialized rosgraph_msgs/Clock: secs, nsecs


class Controls(Protocol):
    """The player's methods that outputs call. Thread-safe."""

    def end(self) -> None:
        """Stop playing."""

    def set_paused(self, paused: bool) -> bool:
        """Pause or resume; return whether the state has changed."""

    def control_rate(self, stamp: int) -> None:
        """Store the timestamp of the last message on the rate control topic."""


class Output(Protocol):
    """The destination of a player's messages. All methods are called in the player's thread."""

    def open(self, player: Controls) -> None:
        """Prepare the output. When its connection to the graph shuts down, end the player.

        This method is called first.
        """

    def advertise(self, connections: Sequence[tuple[int, Connection]]) -> None:
        """Advertise the connections' topics. Each connection comes with the index of its bag."""

    def offer(self, player: Controls) -> None:
        """Offer controls for the player, such as a service."""

    def has_all_subscribers(self) -> bool:
        """Return whether each topic has a subscriber."""

    def running(self, on_key: Callable[[str], object]) -> AbstractContextManager[None]:
        """Return a context manager for playing. While it is active, each typed key is passed to ``on_key``."""

    def publish(self, number: int, message: StoredMessage) -> None:
        """Publish a message from the bag with this index."""

    def publish_clock(self, time: int) -> None:
        """Publish the bag time on /clock."""

    def waiting_bytes(self) -> int:
        """Return the number of bytes queued for subscribers."""

    def print(self, text: str, end: str = "\n") -> None:
        """Print a line for the user."""


class _Outlet:
    """A recorded publisher. All recorded publishers of a topic share one real publisher."""

    def __init__(self, publisher: client.Publisher[client.AnyMsg], is_latched: bool) -> None:
        self.publisher = publisher
        self.message = publisher.data_class()
        self.is_latched = is_latched
        self.last: bytes | None = None  # the last message, if the publisher is latched

    def publish(self, body: bytes) -> None:
        self.message._buff = body
        if self.is_latched:
            self.last = body
        self.publisher.publish(self.message)


class _LateSubscribers(client.SubscribeListener):
    """Sends each latched publisher's last message to late subscribers, because a latched topic keeps only one message."""

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


class NodeOutput:
    """Publishes with this process's node and prints to the terminal. Call init_node() first."""

    def __init__(self, options: PlayOptions) -> None:
        self._options = options
        self._publishers: dict[str, tuple[client.Publisher[client.AnyMsg], _LateSubscribers]] = {}
        self._outlets: dict[tuple[int, int], _Outlet | None] = {}
        self._clock: client.Publisher[client.AnyMsg] | None = None
        self._is_header_first: bool | None = None

    def open(self, player: Controls) -> None:
        """See :meth:`Output.open`."""
        client.on_shutdown(player.end)

    def advertise(self, connections: Sequence[tuple[int, Connection]]) -> None:
        """See :meth:`Output.advertise`."""
        self._clock = client.Publisher("clock", frame_class(*_clock_type()), queue_size=1)
        for number, connection in connections:
            self._advertise(number, connection)

    def offer(self, player: Controls) -> None:
        """Offer the service ~pause_playback and subscribe to the rate control topic."""
        from std_srvs.srv import SetBool, SetBoolResponse

        def pause(request: SetBoolRequest) -> SetBoolResponse:
            if player.set_paused(request.data):
                return SetBoolResponse(True, "Playback is now " + ("paused" if request.data else "resumed"))
            return SetBoolResponse(False, "Bag is already " + ("paused." if request.data else "running."))

        client.Service("~pause_playback", SetBool, pause)
        if self._options.rate_control_topic:
            self.print("Creating rate control topic subscriber...", end="")
            client.Subscriber(
                self._options.rate_control_topic, ReceivedFrame, self._on_rate_control, callback_args=player
            )
            self.print(" done.")

    def has_all_subscribers(self) -> bool:
        """See :meth:`Output.has_all_subscribers`."""
        return all(publisher.get_num_connections() for publisher, _ in self._publishers.values())

    @contextlib.contextmanager
    def running(self, on_key: Callable[[str], object]) -> Iterator[None]:
        """Return a context manager that reads keys and shortens the GIL switch interval."""
        interval = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_SECONDS)
        # Exclude existing objects from garbage collection: traversing the imported modules takes milliseconds.
        gc.freeze()
        try:
            with read_keys(on_key):
                yield
        finally:
            sys.setswitchinterval(interval)

    def publish(self, number: int, message: StoredMessage) -> None:
        """See :meth:`Output.publish`."""
        outlet = self._outlets[number, message.connection.id]
        if outlet:
            outlet.publish(message.body)

    def publish_clock(self, time: int) -> None:
        """See :meth:`Output.publish_clock`."""
        if self._clock:
            message = self._clock.data_class()
            message._buff = CLOCK.pack(*divmod(time, _SECOND))
            self._clock.publish(message)

    def waiting_bytes(self) -> int:
        """See :meth:`Output.waiting_bytes`."""
        topics = [publisher.impl for publisher, _ in self._publishers.values()]
        return sum(link.waiting_bytes for topic in topics if topic for link in topic.publication.links)

    def print(self, text: str, end: str = "\n") -> None:
        """See :meth:`Output.print`."""
        with contextlib.suppress(OSError, ValueError):
            if text.startswith("\r") and isinstance(sys.stdout, SafeTerminal):
                # The status line is rewritten in place, so do not escape its control characters.
                sys.stdout.write_own(text)
                text = ""
            print(text, end=end, flush=True)

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

    def _on_rate_control(self, message: ReceivedFrame, player: Controls) -> None:
        if self._is_header_first is None:
            definition = message._connection_header.get("message_definition", "")
            self._is_header_first = _starts_with_header(definition)
        frame = message.frame
        if not self._is_header_first or len(frame) < _STAMP.size:
            print("\nWARNING: Rate control topic is bad, header is not first. MSG may be malformed.")
            return
        secs, nsecs = _STAMP.unpack_from(frame)
        player.control_rate(secs * _SECOND + nsecs)


def _clock_type() -> tuple[str, str, str]:
    from rosgraph_msgs.msg import Clock

    return Clock._type, Clock._md5sum, Clock._full_text


def _starts_with_header(definition: str) -> bool:
    lines: Iterable[str] = (line.strip() for line in definition.splitlines())
    first = next((line for line in lines if line and not line.startswith("#")), "")
    return first.startswith(("Header ", "std_msgs/Header "))
