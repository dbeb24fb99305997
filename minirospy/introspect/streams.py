"""The nodes that tools use to listen and publish. A process may have several of them.

Messages arrive in one worker per connection; :class:`Inbox` passes them to the reading thread, and blocks the workers
while that thread is busy, so that a slow terminal does not make memory grow.
"""

from __future__ import annotations

import os
import queue
import sys
import threading
import time
from typing import TYPE_CHECKING

from minirospy.base.clock import (
    Clock,
    SignalSafeEvent,
    SignalSafeQueue,
    SimulatedClock,
    WallClock,
    time_of_clock_message,
)
from minirospy.base.errors import MessageException, MinirospyError, RpcRefused
from minirospy.core.idl.protocols import is_stamped
from minirospy.core.wire.framing import Frame, serialize_frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.introspect.messages import MessageClasses, Received, serialize
from minirospy.introspect.topics import TopicField, find_topic
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport.loop import LoopThread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType

    from minirospy.base.environment import Environment
    from minirospy.core.idl.protocols import Message
    from minirospy.introspect.graph import Graph

__all__ = ["Inbox", "ToolNode", "TopicPublisher", "wait_for_topic"]

_POLL_SECONDS = 0.1
_WAITING = 64  # maximum number of messages queued for the thread that reads

_SLICE = 0.05 if sys.platform == "win32" else 3600.0
"""Maximum seconds per wait of the main thread.

On Windows Ctrl-C does not interrupt a wait, so waits there are split into short slices.
"""


class ToolNode:
    """Context manager for a command's node named ``name``, by default ``<tool>_<pid>_<milliseconds>``.

    ``ended`` is set when the node has to stop. ``clock`` is the machine's time or, with ``ros_time`` and if the
    parameter /use_sim_time is set, the time from /clock; ``simulated`` is True in the latter case. Raise
    MasterUnreachableError if no master responds.
    """

    def __init__(
        self, environment: Environment, tool: str, *, name: str = "", ros_time: bool = False
    ) -> None:
        name = name or f"{tool}_{os.getpid()}_{time.time_ns() // 1_000_000}"
        self.name = f"{environment.namespace.rstrip('/')}/{name}"
        self.ended = SignalSafeEvent()
        self.classes = MessageClasses()
        self.clock: Clock = WallClock()
        self.simulated = False
        self._fault: Exception | None = None
        self._listeners: dict[str, _Listeners] = {}
        self._on_end: list[Callable[[], object]] = []
        self._loop = LoopThread(f"{tool}-loop")
        self._node = Node(self.name, environment, on_shutdown=self._asked_to_stop)

        try:
            self._loop.run(self._node.start())
            if ros_time:
                self._follow_clock(environment.master_uri)
        except BaseException:
            # Ctrl-C may have interrupted the start after the node's servers were opened.
            self.close()
            raise

    def __enter__(self) -> ToolNode:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Unregister the node and close its connections. Idempotent."""
        self._end()
        self._loop.run(self._node.close())
        self._loop.close()

    def wait(self, seconds: float) -> bool:
        """Wait for ``seconds``, or until the node must stop. Return whether it must stop.

        Raise the exception of a function passed to :meth:`measure`, if it raised one.
        """
        end = time.monotonic() + seconds
        while not self.ended.is_set():
            rest = end - time.monotonic()
            if rest <= 0:
                return False
            self.ended.wait(min(rest, _SLICE))
        if self._fault:
            raise self._fault
        return True

    def wait_for_time(self, seconds: float) -> None:
        """Wait until /clock has published a time, for at most ``seconds``."""
        end = time.monotonic() + seconds
        while not self.clock.now() and time.monotonic() < end and not self.wait(0.01):
            pass

    def listen(
        self, topic: str, deliver: Callable[[Frame, Header], None], *, tcp_nodelay: bool = False
    ) -> None:
        """Subscribe to a topic of any type; call ``deliver(bytes, header)`` in a worker for each message.

        The bytes are valid only during the call. A node subscribes to a topic only once, so the same worker also calls
        later listeners, for example for /clock, which the node itself uses. A later listener is first called in this
        thread, with the last message received from each latched publisher.
        """
        if topic in self._listeners:
            self._listeners[topic].add(deliver)
            return

        listeners = self._listeners[topic] = _Listeners(deliver)
        subscription = self._node.make_subscription(
            topic, InterfaceType(ANY, ANY), listeners.deliver, tcp_nodelay=tcp_nodelay
        )
        self._loop.run(self._node.subscribe(subscription))

    def measure(self, topic: str, add: Callable[[Received], object], *, tcp_nodelay: bool = False) -> None:
        """Call ``add`` in a worker for each message on a topic. If ``add`` raises an exception, :meth:`wait` raises it."""

        def deliver(body: Frame, header: Header) -> None:
            try:
                add(Received(bytes(body), header, self.clock.now()))
            except (MinirospyError, MessageException) as error:
                self._fault = error
                self._end()

        self.listen(topic, deliver, tcp_nodelay=tcp_nodelay)

    def stop(self) -> None:
        """Make :meth:`wait` return, and end all inboxes."""
        self._end()

    def inbox(self, topic: str) -> Inbox:
        """Subscribe to a topic; return an inbox with its messages. Only one thread may read the inbox."""
        inbox = Inbox(self.clock)
        self._on_end.append(inbox.close)
        self.listen(topic, inbox.put)
        return inbox

    def publisher(
        self, topic: str, message_class: type[Message], *, latch: bool, queue_size: int = 100
    ) -> TopicPublisher:
        """Advertise a topic. Its message class must be installed."""
        type_ = InterfaceType.of(message_class)
        publication = Publication(topic, type_, queue_size=queue_size, latch=latch)
        self._loop.run(self._node.advertise(publication))
        return TopicPublisher(publication)

    def _follow_clock(self, master_uri: str) -> None:
        master = MasterProxy(master_uri, self.name)
        try:
            self.simulated = bool(master.get_param("/use_sim_time"))
        except RpcRefused:
            return  # the parameter is not set
        finally:
            master.close()
        if self.simulated:
            clock = self.clock = SimulatedClock()

            def set_clock(body: Frame, _: Header) -> None:
                if (now := time_of_clock_message(body)) is not None:
                    clock.set(now)

            self.listen("/clock", set_clock)

    def _asked_to_stop(self, _reason: str) -> None:
        self._end()

    def _end(self) -> None:
        self.ended.set()
        for function in self._on_end:
            function()


class _Listeners:
    """The functions to call with each message on a topic."""

    def __init__(self, first: Callable[[Frame, Header], None]) -> None:
        self._functions: tuple[Callable[[Frame, Header], None], ...] = (first,)
        self._lock = threading.Lock()
        # The last message of each latched publisher, keyed by the publisher's name.
        self._latched: dict[str, tuple[bytes, Header]] = {}

    def add(self, function: Callable[[Frame, Header], None]) -> None:
        """Call ``function`` immediately with the latched messages, then with each new message."""
        with self._lock:
            self._functions += (function,)
            latched = [*self._latched.values()]
        for body, header in latched:
            function(body, header)

    def deliver(self, body: Frame, header: Header) -> None:
        """Pass a new message to all functions. Called in a worker."""
        # With the lock, a function that is being added gets this message exactly once: either here or in add().
        with self._lock:
            functions = self._functions
            if header.get("latching") == "1":
                self._latched[header.get("callerid", "")] = bytes(body), header
        for function in functions:
            function(body, header)


class Inbox:
    """A queue between the workers, which receive messages, and the single thread that reads them."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._messages: SignalSafeQueue[Received | None] = SignalSafeQueue(_WAITING)
        self._closed = SignalSafeEvent()

    def put(self, body: Frame, header: Header) -> None:
        """Queue a message; block while the queue is full."""
        received = Received(bytes(body), header, self._clock.now())
        while not self._closed.is_set():
            try:
                self._messages.put(received, timeout=0.2)
            except queue.Full:
                continue
            return

    def close(self) -> None:
        """Make the reader stop after it has read all queued messages."""
        if not self._closed.is_set():
            self._closed.set()
            try:
                self._messages.put(None, timeout=0)
            except queue.Full:
                pass  # the queue is full: the reader will check the flag once it has read the queued messages

    def __iter__(self) -> Iterator[Received]:
        while True:
            try:
                received = self._messages.get(timeout=min(_SLICE, 1.0))
            except queue.Empty:
                if self._closed.is_set():
                    return
                continue
            if received is None:
                return
            yield received


class TopicPublisher:
    """Publishes messages on a topic from a single thread."""

    def __init__(self, publication: Publication) -> None:
        self._publication = publication
        self._sequence = 0

    @property
    def connections(self) -> int:
        """Return the number of connected subscribers."""
        return len(self._publication.links)

    def wait_for_subscriber(self, wait: Callable[[float], bool], seconds: float) -> None:
        """Wait until a subscriber is connected, ``seconds`` have passed, or ``wait(step)`` returns True."""
        end = time.monotonic() + seconds
        while not self.connections and time.monotonic() < end and not wait(0.02):
            pass

    def publish(self, message: Message) -> None:
        """Set the sequence number in the message's header; send the message. Raise MessageException if a value is invalid."""
        if is_stamped(message):
            self._sequence += 1
            message.header.seq = self._sequence
        self._publication.publish(serialize_frame(serialize(message)))


def wait_for_topic(graph: Graph, name: str, on_waiting: Callable[[], object]) -> TopicField:
    """Wait until ``name``, a topic or a field of a topic, is published. Return the topic and the field.

    Call ``on_waiting`` once if this has to wait.
    """
    field = find_topic(graph, name)
    if field is None:
        on_waiting()
    while field is None:
        time.sleep(_POLL_SECONDS)
        field = find_topic(graph, name)
    return field
