"""The ROS half that all clients share: one subscription per topic, one publication per topic, one view of the graph.

Messages stay serialized. Graph queries are in ``introspect/``; nodes, topics and services come from ``aio/``.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field

from minirospy.aio.node import Node
from minirospy.aio.raw import RawSubscription, call_raw, raw_class, service_header
from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.aio.topics import JOIN_SECONDS, Publisher
from minirospy.base.errors import (
    BridgeError,
    HandshakeRefused,
    MasterUnreachableError,
    RpcError,
    ServiceException,
)
from minirospy.base.name_filter import NameFilter
from minirospy.core.idl.protocols import Message
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.introspect.node_queries import NodeQueries
from minirospy.introspect.snapshot import Changes, Snapshot, compare, fetch, moved
from minirospy.introspect.type_texts import ServiceInfo, TypeTexts, described

__all__ = ["Arrival", "Filters", "GraphListener", "Publication", "SharedGraph", "TopicListener"]

_log = logging.getLogger(__name__)

MIN_REFRESH_INTERVAL = 0.25  # minimum interval in seconds between refreshes while the graph changes

_QUEUE = 100
_MAX_WAITING = 32_000_000
"""Maximum total size in bytes of client messages queued for subscribers of new topics.

Above this limit, only the newest message per topic is queued.
"""

CHECK_SECONDS = 2.0  # seconds between checks of known services' types; each check takes one connection
_QUERY_SECONDS = 2.0
"""Timeout in seconds for querying service types; types that are still unknown then are missing in the reported graph."""


@dataclass(frozen=True)
class Filters:
    """Filters for the names of topics, services and parameters that clients may use."""

    topics: NameFilter = field(default_factory=NameFilter)
    publishable: NameFilter = field(default_factory=NameFilter)
    services: NameFilter = field(default_factory=NameFilter)
    parameters: NameFilter = field(default_factory=NameFilter)


@dataclass(frozen=True)
class Arrival:
    """A received message: its bytes, its publisher's connection header, and its receive time in ns of the node's time."""

    body: bytes | memoryview
    header: Header
    nanoseconds: int


ServiceKey = tuple[str, tuple[str, ...]]
"""A service's name, and the nodes that offer it."""
TopicListener = Callable[[Arrival], object]
GraphListener = Callable[[Changes], object]


class SharedTopic:
    """A topic with at least one listening client."""

    def __init__(self, graph: SharedGraph, topic: str) -> None:
        self.topic = topic
        self.received = 0
        self.received_bytes = 0
        self._graph = graph
        self._listeners: list[TopicListener] = []
        # The last message of each publisher, keyed by the id() of the connection header; each connection has one header object.
        self._latched: dict[int, Arrival] = {}
        self._subscription: RawSubscription | None = None
        self._has_connected = asyncio.Event()  # set when a publisher has connected; cleared before a wait

    @property
    def headers(self) -> list[Header]:
        """Return the connection headers of the connected publishers."""
        return self._subscription.headers if self._subscription else []

    @property
    def is_wanted(self) -> bool:
        """Return whether the topic has listeners."""
        return bool(self._listeners)

    def add(self, listener: TopicListener) -> None:
        """Call ``listener`` with the last message of each latched publisher, and then with each new message."""
        if self._subscription is None:
            self._subscription = self._graph.node.subscribe_raw(
                self.topic, self._deliver, on_change=self._has_connected.set
            )
            self._graph.subscribed_own(self.topic)
        # Connected publishers do not send their latched messages again, so deliver the stored ones.
        self._forget_disconnected()
        for arrival in list(self._latched.values()):
            listener(Arrival(arrival.body, arrival.header, self._graph.now()))
        self._listeners.append(listener)

    def remove(self, listener: TopicListener) -> None:
        """Stop calling ``listener``."""
        with contextlib.suppress(ValueError):
            self._listeners.remove(listener)

    async def wait_for_publisher(self, name: str) -> None:
        """Wait, at most a second, until the node ``name`` has connected as a publisher or no listener is left."""

        async def connected() -> None:
            while self.is_wanted and not any(header.get("callerid") == name for header in self.headers):
                self._has_connected.clear()
                await self._has_connected.wait()

        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(connected(), JOIN_SECONDS)

    async def close(self) -> None:
        """Unsubscribe from the topic."""
        subscription, self._subscription = self._subscription, None
        if subscription:
            await subscription.close()

    def _deliver(self, frame: Frame, header: Header) -> None:
        arrival = Arrival(frame, header, self._graph.now())
        self.received += 1
        self.received_bytes += len(frame)
        if header.get("latching") == "1":
            if id(header) not in self._latched:
                self._forget_disconnected()
            self._latched[id(header)] = arrival
        for listener in tuple(self._listeners):
            listener(arrival)

    def _forget_disconnected(self) -> None:
        connected = {id(header) for header in self.headers}
        for key in [key for key in self._latched if key not in connected]:
            del self._latched[key]


class Publication:
    """A client's handle for a topic that this node publishes with ``publish(bytes)``."""

    def __init__(self, graph: SharedGraph, topic: str, shared: _SharedPublisher) -> None:
        self.topic = topic
        self._graph = graph
        self._shared: _SharedPublisher | None = shared
        self._waiting: deque[bytes] | None = None
        """Messages queued until the subscribers are connected; None if they are connected."""

    @property
    def has_joined(self) -> bool:
        """Return whether the subscribers that the master listed when the topic was advertised have connected."""
        return self._shared is None or self._shared.joining is None or self._shared.joining.done()

    async def joined(self) -> None:
        """Wait, for at most a second, until the subscribers that the master listed when the topic was advertised have connected.

        Subscribers do not receive messages published before they connect.
        """
        if self._shared and self._shared.joining:
            await asyncio.wait([self._shared.joining])

    def publish(self, body: bytes) -> None:
        """Publish a serialized message without waiting. May be called from any thread."""
        shared = self._shared
        if shared:
            shared.publisher.publish_raw(body)

    def publish_when_joined(self, body: bytes) -> None:
        """Publish a message after the current subscribers have connected. The order of messages is preserved.

        Does not block; a full queue drops its oldest message.
        """
        if self._waiting is None:
            if self.has_joined or not (self._shared and self._shared.joining):
                self.publish(body)
                return
            self._waiting = deque()
            self._shared.joining.add_done_callback(lambda _: self._publish_waiting())

        self._waiting.append(body)
        self._graph.waiting_bytes += len(body)
        while len(self._waiting) > _QUEUE or (
            self._graph.waiting_bytes > _MAX_WAITING and len(self._waiting) > 1
        ):
            self._graph.waiting_bytes -= len(self._waiting.popleft())

    def _publish_waiting(self) -> None:
        waiting, self._waiting = self._waiting, None
        for body in waiting or ():
            self._graph.waiting_bytes -= len(body)
            self.publish(body)

    def close(self) -> None:
        """Release this handle. Unadvertise the topic when its last handle is released. Idempotent."""
        self._publish_waiting()
        shared, self._shared = self._shared, None
        if shared:
            self._graph.left_publisher(self.topic, shared)


@dataclass
class _SharedPublisher:
    type: InterfaceType
    latch: bool
    publisher: Publisher[Message]
    joining: asyncio.Task[None] | None = None
    clients: int = 0


class SharedGraph:
    """The ROS graph as shared by all clients of the bridge. Runs on the node's loop."""

    def __init__(
        self,
        node: Node,
        filters: Filters | None = None,
        *,
        max_refresh_interval: float = 1.0,
        clock: Callable[[], int] | None = None,
    ) -> None:
        """Create the graph.

        ``max_refresh_interval``: seconds between refreshes if nothing changes. ``clock``: see :meth:`now`.
        """
        self.node = node
        self._clock = clock
        self.waiting_bytes = 0
        """Total bytes of clients' messages that are queued for subscribers of new topics."""
        self.filters = filters or Filters()
        self.snapshot = Snapshot()
        self.topics: dict[str, SharedTopic] = {}
        self.texts = TypeTexts(node)
        self._is_first_look = True
        self.max_refresh_interval = max(max_refresh_interval, MIN_REFRESH_INTERVAL)
        self._listeners: list[GraphListener] = []
        self.publishers: dict[str, _SharedPublisher] = {}
        self._refresh_soon = asyncio.Event()
        self._looking = asyncio.Lock()
        self._reporter = ErrorReporter(_log, "a task of the bridge")
        self._watching: asyncio.Task[None] | None = None
        self.tasks: set[asyncio.Task[None]] = set()
        self._service_infos: dict[ServiceKey, ServiceInfo] = {}  # types of services at the last refresh
        self._service_order: tuple[
            ServiceKey, ...
        ] = ()  # services at the last refresh, in the master's order
        self._check_after = 0.0  # loop time at which to check the type of the next known service
        self._unchecked: list[ServiceKey] = []  # services whose types have not been checked in this round
        self._service_types = NodeQueries(
            self._service_type,
            ErrorReporter(_log, "the query for a service's type"),
            arrived_late=self.refresh_soon,
        )

    def now(self) -> int:
        """Return the time for messages in nanoseconds: from ``clock`` if it is set, otherwise the node's time."""
        if self._clock:
            return self._clock()
        now = self.node.now()
        return now.secs * 1_000_000_000 + now.nsecs

    async def close(self) -> None:
        """Close all subscriptions, publications and tasks. Idempotent."""
        tasks = [*self.tasks, *([self._watching] if self._watching else [])]
        self._watching = None
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self._service_types.close()
        await self.texts.close()

    # --- graph

    def watch(self, listener: GraphListener) -> None:
        """Call ``listener`` with each change of the graph. The first change that the first listener gets is the whole graph."""
        self._listeners.append(listener)
        if self._watching is None:
            self.snapshot = Snapshot()
            self._is_first_look = True
            self._watching = asyncio.ensure_future(keep_running(self._watch, self._reporter))
        self._refresh_soon.set()

    def unwatch(self, listener: GraphListener) -> None:
        """Stop calling ``listener``. The graph is not polled without listeners."""
        with contextlib.suppress(ValueError):
            self._listeners.remove(listener)
        if not self._listeners and self._watching:
            self._watching.cancel()
            self._watching = None

    def refresh_soon(self) -> None:
        """Schedule a refresh of the graph, because something has changed."""
        self._refresh_soon.set()

    async def look(self) -> None:
        """Refresh the graph and report changes. Raise MasterUnreachableError or RpcError if a call to the master fails."""
        # Run one refresh at a time, so that an older snapshot does not replace a newer one.
        async with self._looking:
            found = await fetch(self.node.call_master)
            await self._look_up_services(found)
            after = found.filtered(self.filters.topics, self.filters.services)
            before, self.snapshot = self.snapshot, after
            changes = compare(before, after)
            is_first, self._is_first_look = self._is_first_look, False
            infos = dict(self._service_types.found)
            has_types = infos != self._service_infos
            self._service_infos = infos
            if changes or is_first or has_types or before.types != after.types:
                for listener in tuple(self._listeners):
                    try:
                        listener(changes)
                    except Exception as error:  # noqa: BLE001 - of one client: the others are notified
                        self._reporter.report(error)

    async def _watch(self) -> None:
        pause = MIN_REFRESH_INTERVAL
        is_reported = False

        # Check the task: before Python 3.12, asyncio.wait_for may lose a cancellation that coincides with the event.
        task = asyncio.current_task()
        while self._watching is task:
            self._refresh_soon.clear()
            before = self.snapshot
            try:
                await self.look()
                is_reported = False
            except (MasterUnreachableError, RpcError) as error:
                if not is_reported:
                    _log.warning("the graph cannot be read: %s. Will keep trying.", error)
                is_reported = True
            pause = (
                MIN_REFRESH_INTERVAL
                if self.snapshot is not before and self.snapshot != before
                else min(pause * 1.5, self.max_refresh_interval)
            )
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._refresh_soon.wait(), pause)

    def service_info(self, service: str) -> ServiceInfo | None:
        """Return the type of a service, or None if it is unknown or not installed."""
        return self._service_types.found.get((service, self.snapshot.services.get(service, ())))

    async def _look_up_services(self, found: Snapshot) -> None:
        """Query the nodes of new services for the types, because the master does not store them."""
        wanted = {key: None for key in found.services.items() if self.filters.services(key[0])}
        self._check_known_services(dict(wanted))
        await self._service_types.look(wanted, _QUERY_SECONDS)

    def _check_known_services(self, wanted: dict[ServiceKey, None]) -> None:
        """Query types that may have changed: since the last refresh, a node may have offered a service again with another type.

        The master then moves the service to the end of its list, which reveals the change unless the service was already last.
        Therefore one service is also checked every few seconds, in turn.
        """
        for name in moved(dict(self._service_order), dict(wanted)):
            self._service_types.refresh((name, self.snapshot.services.get(name, ())))
        self._service_order = (*wanted,)

        now = asyncio.get_running_loop().time()
        if now < self._check_after:
            return
        self._check_after = now + CHECK_SECONDS
        self._unchecked = [key for key in self._unchecked if key in wanted] or [*wanted]
        if self._unchecked:
            # The master moves a service that is offered again to the end of its list. The last one cannot move: check it first.
            self._service_types.refresh(self._unchecked.pop())

    def check_service(self, service: str) -> None:
        """Query a service's type again, because a call has shown that the type has changed."""
        self._service_types.refresh((service, self.snapshot.services.get(service, ())))

    async def _service_type(self, key: ServiceKey) -> ServiceInfo:
        return described(key[0], await service_header(self.node, key[0]))

    # --- topics

    def subscribe(self, topic: str, listener: TopicListener) -> None:
        """Call ``listener`` with each message on a topic, and immediately with the last message of each latched publisher."""
        shared = self.topics.get(topic)
        if shared is None:
            shared = self.topics[topic] = SharedTopic(self, topic)
        shared.add(listener)

    def unsubscribe(self, topic: str, listener: TopicListener) -> None:
        """Stop calling ``listener``. Unsubscribe from the topic when its last listener has been removed."""
        shared = self.topics.get(topic)
        if shared:
            shared.remove(listener)
            if not shared.is_wanted:
                self.spawn(self._end_topic(shared))

    async def _end_topic(self, shared: SharedTopic) -> None:
        if shared.is_wanted:
            return  # a new listener has been added meanwhile
        await shared.close()
        if not shared.is_wanted and self.topics.get(shared.topic) is shared:
            del self.topics[shared.topic]

    def advertise(self, topic: str, type_: InterfaceType, *, latch: bool = False) -> Publication:
        """Advertise a topic; return a handle for publishing on it.

        Raise BridgeError if clients may not publish it, or if it is already published with another type.
        """
        if not self.filters.publishable(topic):
            raise BridgeError(f"topic [{topic}] may not be published by clients")
        shared = self.publishers.get(topic)
        if shared is None:
            known = self.snapshot.types.get(topic)
            if known not in (None, ANY, type_.name):
                raise BridgeError(f"topic [{topic}] is of type [{known}], not [{type_.name}]")
            publisher = self.node.advertise(topic, raw_class(type_), queue_size=_QUEUE, latch=latch)
            shared = self.publishers[topic] = _SharedPublisher(type_, latch, publisher)
            shared.joining = self.spawn(self._join(topic, shared))
            self.refresh_soon()
        elif shared.type.md5sum != type_.md5sum:
            raise BridgeError(f"topic [{topic}] is published as [{shared.type.name}] by another client")
        shared.clients += 1
        return Publication(self, topic, shared)

    def subscribed_own(self, topic: str) -> None:
        """Record that this node has subscribed to a topic. Its own messages there wait until the subscription is connected."""
        shared = self.publishers.get(topic)
        if shared:
            shared.joining = self.spawn(self._join_own(topic, shared.joining))

    async def _join(self, topic: str, shared: _SharedPublisher) -> None:
        """Wait until this node's own subscriber and the subscribers known to the master are connected to the publisher."""
        await shared.publisher.wait_for_expected()
        await self._join_own(topic)

    async def _join_own(self, topic: str, before: asyncio.Task[None] | None = None) -> None:
        """Wait for the task ``before``, then until this node's own subscription is connected."""
        if before:
            await asyncio.wait([before])
        own = self.topics.get(topic)
        if own and own.is_wanted:
            await own.wait_for_publisher(self.node.name)

    def left_publisher(self, topic: str, shared: _SharedPublisher) -> None:
        """Record that a client has stopped publishing a topic. Unadvertise the topic if that was its last client."""
        shared.clients -= 1
        if not shared.clients and self.publishers.get(topic) is shared:
            del self.publishers[topic]
            self.spawn(shared.publisher.close())
            self.refresh_soon()

    # --- services

    async def call(self, service: str, md5sum: str, request: bytes) -> bytes:
        """Call a service; return the serialized response.

        Raise ServiceException if the call fails, or BridgeError if clients may not call the service.
        """
        if not self.filters.services(service):
            raise BridgeError(f"service [{service}] may not be called by clients")
        try:
            return await call_raw(self.node, service, md5sum, request)
        except ServiceException as error:
            if isinstance(error.__cause__, HandshakeRefused):
                self.check_service(service)
            raise

    def spawn(self, work: Coroutine[object, object, object]) -> asyncio.Task[None]:
        """Run a coroutine as a task until :meth:`close`; log any exception."""

        async def guarded() -> None:
            try:
                await work
            except (MasterUnreachableError, RpcError, ServiceException, BridgeError) as error:
                _log.warning("%s", error)
            except Exception as error:  # noqa: BLE001 - the edge of a task: nobody else would read it
                self._reporter.report(error)

        task = asyncio.ensure_future(guarded())
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)
        # If the task is cancelled before its first step, the coroutine was never started and must be closed.
        task.add_done_callback(lambda _: work.close())
        return task
