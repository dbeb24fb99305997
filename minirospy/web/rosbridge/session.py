"""One client of the rosbridge protocol: its subscriptions, publications, calls and services."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import sys
from collections import deque
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from minirospy.aio.handle import serialized
from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import (
    BridgeError,
    MessageException,
    MinirospyError,
    ROSSerializationException,
    ServiceException,
)
from minirospy.core.idl.protocols import Message, is_stamped
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.introspect.graph import why_illegal
from minirospy.web.graph import Publication
from minirospy.web.rosbridge import conversion, protocol
from minirospy.web.rosbridge.authentication import authenticate
from minirospy.web.rosbridge.protocol import Event, OperationError, StatusLevel
from minirospy.web.rosbridge.services import ClientService, call
from minirospy.web.rosbridge.subscription import Budget, Fragments
from minirospy.web.rosbridge.topic import MAX_IDS, ClientTopic
from minirospy.web.rosbridge.types import message_class

if TYPE_CHECKING:
    from minirospy.web.rosbridge.endpoint import RosbridgeEndpoint
    from minirospy.web.server.connection import WebClient

__all__ = ["RosbridgeSession"]

_log = logging.getLogger(__name__)

_MAX_CALLS = 200
_MAX_TOPICS = 1000
_MAX_SERVICES = 200
_MAX_WAITING = 64_000_000
"""Calls under way, topics published or subscribed, services offered, bytes that wait for an earlier message (and the same of
latched messages): of a client."""

_LARGE_LATCHED = 100_000
"""Bytes of a latched message that is not kept when its publisher has left."""

_VALUE_FACTOR = 4
"""Memory of an operation that has been parsed, as a multiple of its text's: that of objects and lists of numbers."""

_MAX_READ_ONLY_CBOR = 8 * 1024  # bytes: a client that subscribes needs less, and each may be a value

_POLICY = 1008
_FAILED = 1011

_REFUSALS = (MinirospyError, ServiceException, ROSSerializationException, MessageException)
"""What is reported to the client."""

_Work = Coroutine[object, object, None]


class _Pending(NamedTuple):
    """The rest of an operation, which has to wait for something; the event is None if it reports its faults itself."""

    event: Event | None
    work: _Work


@dataclass
class _Published:
    """A topic that a client publishes: the ids of its advertisements, and the numbers of headers."""

    publication: Publication
    message_class: type[Message]
    latch: bool = False
    latched: int = 0
    """Bytes of the last message, if it is kept for later subscribers."""
    ids: set[object] = field(default_factory=set)
    numbers: itertools.count[int] = field(default_factory=lambda: itertools.count(1))


class RosbridgeSession:
    """The state of one client; called by its connection, on the loop.

    Operations are carried out in the order in which they came: where one has to wait (for the graph, for the subscribers of a
    new topic), those behind it wait, except for calls of services.
    """

    def __init__(self, endpoint: RosbridgeEndpoint, client: WebClient) -> None:
        self.client = client
        self.connected = endpoint.graph.node.now()
        self.budget = Budget()
        """For messages of topics whose rate the client limits."""
        self._endpoint = endpoint
        self._graph = endpoint.graph
        self._level = StatusLevel.ERROR
        self._is_authenticated = not endpoint.options.authenticate
        self._fragments = Fragments(endpoint.options.fragment_timeout)

        self._subscribed: dict[str, ClientTopic] = {}
        self._published: dict[str, _Published] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._reporter = ErrorReporter(_log, "a client's call of a service")
        self._calls = 0
        self._calls_size = 0
        """Memory of the calls under way."""
        self._latched_size = 0
        """Memory of the last messages of topics that the client publishes latched."""
        self._inbox: deque[str | bytes] = deque()
        self._inbox_size = 0
        """Memory of the operations that wait, and of the one that is waited for."""
        self._operation_size = 0
        """Memory of the operation that is being carried out."""
        self._is_working = False
        self._is_large = False
        # The operation that is carried out came in a large message: a thread makes the ROS message of it, too.
        self._handlers: Mapping[type[Event], Callable[[Any], _Work | _Pending | None]] = {
            protocol.Advertise: self._advertise,
            protocol.Unadvertise: self._unadvertise,
            protocol.Publish: self._publish,
            protocol.Subscribe: self._subscribe,
            protocol.Unsubscribe: self._unsubscribe,
            protocol.CallService: self._call_service,
            protocol.ServiceResponse: self._service_response,
            protocol.AdvertiseService: self._advertise_service,
            protocol.UnadvertiseService: self._unadvertise_service,
            protocol.Fragment: self._fragment,
            protocol.SetLevel: self._set_level,
            protocol.Auth: self._auth,
        }

    # --- from the connection

    def received_text(self, text: str) -> None:
        """Take over a JSON message."""
        self._received(text)

    def received_binary(self, data: bytes) -> None:
        """Take over a CBOR message."""
        if len(data) > _MAX_READ_ONLY_CBOR and not self.client.may_write:
            self._refuse_large(data)
            return
        self._received(data)

    def ended(self) -> None:
        """End everything that the client has."""
        for topic in self._subscribed.values():
            topic.close()
        self._subscribed.clear()
        for published in self._published.values():
            self._release(published)
        self._published.clear()
        for name, service in list(self._endpoint.services.items()):
            if service.session is self:
                self._endpoint.close_service(service, f"the client that offers {name} has disconnected")
        # The session is part of reference cycles: what it keeps is freed now, not when they are collected.
        self._inbox.clear()
        self._fragments.clear()
        for task in list(self._tasks):
            task.cancel()
        self._endpoint.left(self)

    # --- for services and topics

    def send(
        self, fields: Mapping[str, object], compression: str = "none", fragment_size: int | None = None
    ) -> None:
        """Send a message that is not one of a topic."""
        data = protocol.encode(fields, compression)
        if isinstance(data, bytes):
            self.client.send_binary(data)
            return
        size = fragment_size or self._endpoint.options.fragment_size
        id_ = fields.get("id")
        for text in protocol.fragments(data, size, id_) if size else (data,):  # type: ignore[arg-type]
            self.client.send_text(text)

    def status(self, level: StatusLevel, text: str, id_: object = None) -> None:
        """Send a status, where the client has asked for this level."""
        if level <= self._level:
            self.client.send_text(str(protocol.encode(protocol.status(level, text, id_))))  # type: ignore[arg-type]
        if level is not StatusLevel.INFO:
            shown = text if id_ is None else f"[id: {id_}] {text}"
            self._endpoint.log.warning("[Client %s] %s", self.client.name, shown)

    # --- one operation after the other

    def count(self) -> None:
        """Count what is kept of the client in the account of the server."""
        self.client.holds(
            self._inbox_size
            + self._fragments.size
            + self.budget.taken
            + self._calls_size
            + self._latched_size
        )

    def _received(self, data: str | bytes) -> None:
        if not self._is_working:
            self._start(self._begin(data), sys.getsizeof(data))
            return
        self._inbox.append(data)
        self._inbox_size += sys.getsizeof(data)
        if self._inbox_size > _MAX_WAITING:
            self.client.close(_POLICY, "too much waits for an earlier operation")
        self.count()

    def _start(self, first: _Pending | None, size: int) -> None:
        if first is not None:
            self._is_working = True
            self._inbox_size += size
            # A task that is cancelled before its first step does not start the work.
            self._spawn(self._work(first, size)).add_done_callback(lambda _: first.work.close())
            self.count()

    async def _work(self, first: _Pending, size: int) -> None:
        """Finish an operation, whose message has this size, then those that have come meanwhile."""
        try:
            await self._finish(first)
            self._inbox_size -= size
            while self._inbox:
                data = self._inbox.popleft()
                size = sys.getsizeof(data)
                pending = self._begin(data)
                del data
                if pending is not None:
                    await self._finish(pending)
                self._inbox_size -= size
            self.count()
        except Exception:  # noqa: BLE001 whatever an operation raises ends this client alone, as in its connection
            _log.exception("an operation of %s could not be carried out", self.client.name)
            self.client.close(_FAILED, "the bridge failed on this message")
        self._is_working = False

    def _begin(self, data: str | bytes) -> _Pending | None:
        """Carry out an operation; return what is left to be waited for."""
        self._operation_size = _VALUE_FACTOR * sys.getsizeof(data)
        if not protocol.is_quick(data):
            return self._begin_large(data)
        try:
            event = protocol.parse(protocol.decode(data))
        except BridgeError as error:
            self._unreadable(error)
            return None
        return self._carry_out(event)

    def _begin_large(self, data: str | bytes) -> _Pending | None:
        """Parse a large message in a thread, so that no other client waits for it; nothing more is read meanwhile."""
        if not self.client.may_write:
            # What joined fragments or a PNG make: a message of this size is refused by the connection.
            self._refuse_large(data)
            return None
        self.client.pause()
        return _Pending(None, self._carry_out_large(data))

    async def _carry_out_large(self, data: str | bytes) -> None:
        try:
            event = await self._endpoint.in_thread(lambda: protocol.parse(protocol.decode_in_pieces(data)))
        except BridgeError as error:
            self._unreadable(error)
            return
        else:
            self._is_large = True
            pending = self._carry_out(event)
            if pending is not None:
                await self._finish(pending)
        finally:
            self._is_large = False
            self.client.resume()

    def _refuse_large(self, data: str | bytes) -> None:
        what = "characters" if isinstance(data, str) else "bytes of CBOR"
        self.status(
            StatusLevel.ERROR, f"a message of {len(data)} {what} is too large: this token is read-only"
        )

    def _unreadable(self, error: BridgeError) -> None:
        self.status(StatusLevel.ERROR, str(error), error.id if isinstance(error, OperationError) else None)

    def _carry_out(self, event: Event) -> _Pending | None:
        if not self._is_authenticated and not isinstance(event, protocol.Auth):
            self._endpoint.log.warning(
                "Client %s did not authenticate. Closing connection.", self.client.name
            )
            self.client.close(_POLICY, "authentication is required first")
            return None
        try:
            pending = self._handlers[type(event)](event)
        except _REFUSALS as error:
            self._failed(event, error)
            return None
        # What a fragment completes is a separate operation.
        return pending if pending is None or isinstance(pending, _Pending) else _Pending(event, pending)

    async def _finish(self, pending: _Pending) -> None:
        try:
            await pending.work
        except _REFUSALS as error:
            assert pending.event is not None
            self._failed(pending.event, error)

    def _failed(self, event: Event, error: Exception) -> None:
        # rosbridge names the operation where it did not report the fault itself.
        front = "" if isinstance(error, OperationError) else f"{_OPERATIONS[type(event)]}: "
        self.status(StatusLevel.ERROR, f"{front}{error}", event.id)

    def _spawn(self, work: _Work) -> asyncio.Task[None]:
        task = self._graph.spawn(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    # --- topics that the client publishes

    def _advertise(self, event: protocol.Advertise) -> None:
        if not self._is_allowed("topics", event.topic, "topic, cancelling advertisement of"):
            return
        published = self._published.get(event.topic) or self._open(event.topic, event.type, event.latch)
        if published.message_class is not message_class(event.type):
            raise _conflict(event.topic, event.type, published.message_class._type)
        if event.id not in published.ids and len(published.ids) >= MAX_IDS:
            raise BridgeError(f"a client may advertise a topic {MAX_IDS} times")
        published.ids.add(event.id)

    def _unadvertise(self, event: protocol.Unadvertise) -> None:
        published = self._published.get(event.topic)
        if published is None:
            return
        if event.id is None:
            published.ids.clear()
        published.ids.discard(event.id)
        if not published.ids:
            del self._published[event.topic]
            self._latched_size -= published.latched
            self._release(published)
            self.count()

    def _release(self, published: _Published) -> None:
        """End a publication: after a while, in which it may be advertised again, but at once if it keeps a large message."""
        if published.latched > _LARGE_LATCHED:
            published.publication.close()
        else:
            self._endpoint.release(published.publication)

    def _publish(self, event: protocol.Publish) -> _Work | None:
        if not self._is_allowed("topics", event.topic, "topic, cancelling publish to"):
            return None
        published = self._published.get(event.topic)
        if published is None:
            return self._publish_established(event)
        return self._publish_to(published, event)

    async def _publish_established(self, event: protocol.Publish) -> None:
        """Publish on a topic that the client has not advertised: its type is that of the graph."""
        type_ = await self._type_of(event.topic)
        published = self._open(event.topic, type_, event.latch)
        published.ids.add(None)
        pending = self._publish_to(published, event)
        if pending is not None:
            await pending

    def _publish_to(self, published: _Published, event: protocol.Publish) -> _Work | None:
        if self._is_large:
            return self._publish_large(published, event)
        body = self._body(published, event)
        self._count_latched(published, body)
        if published.publication.has_joined:
            published.publication.publish(body)
            return None
        return self._publish_when_joined(published.publication, body)

    async def _publish_large(self, published: _Published, event: protocol.Publish) -> None:
        body = await self._endpoint.in_thread(lambda: self._body(published, event))
        self._count_latched(published, body)
        await self._publish_when_joined(published.publication, body)

    def _count_latched(self, published: _Published, body: bytes) -> None:
        """Count a message that stays as the latched one. Raise BridgeError if the client has too many bytes of them."""
        if not published.latch:
            return
        grown = len(body) - published.latched
        if self._latched_size + grown > _MAX_WAITING:
            raise BridgeError(f"a client may have {_MAX_WAITING} bytes of latched messages")
        self._latched_size += grown
        published.latched = len(body)
        self.count()

    def _body(self, published: _Published, event: protocol.Publish) -> bytes:
        message = published.message_class()
        conversion.fill(message, event.message, self._graph.node.now)
        if is_stamped(message):
            message.header.seq = next(published.numbers)
        return serialized(message)

    async def _publish_when_joined(self, publication: Publication, body: bytes) -> None:
        await publication.joined()
        publication.publish(body)

    def _open(self, topic: str, type_: str, latch: bool) -> _Published:
        self._require_write("publishing")
        _check_name("topic", topic)
        if len(self._published) >= _MAX_TOPICS:
            raise BridgeError(f"a client may publish {_MAX_TOPICS} topics")
        found = message_class(type_)
        resolved = self._graph.node.resolve(topic)
        known = self._graph.snapshot.types.get(resolved, ANY)
        if known not in (ANY, found._type):
            raise _conflict(topic, found._type, known)
        publication = self._graph.advertise(resolved, InterfaceType.of(found), latch=latch)
        published = self._published[topic] = _Published(publication, found, latch)
        return published

    # --- topics that the client subscribes to

    def _subscribe(self, event: protocol.Subscribe) -> _Work | None:
        if not self._is_allowed("topics", event.topic, "topic, cancelling subscription to"):
            return None
        _check_name("topic", event.topic)
        is_known = event.topic in self._subscribed
        if event.compression == "cbor-raw" or (is_known and event.type is None):
            self._add_subscription(event)
            return None
        if event.type is None:
            return self._subscribe_established(event)
        try:
            declared = message_class(event.type)._type
        except BridgeError as error:
            return self._subscribe_unknown(event, error)
        known = self._graph.snapshot.types.get(self._graph.node.resolve(event.topic), ANY)
        if known not in (ANY, declared):
            raise _conflict(event.topic, declared, known)
        self._add_subscription(event)
        return None

    async def _subscribe_established(self, event: protocol.Subscribe) -> None:
        await self._type_of(event.topic)
        self._add_subscription(event)

    async def _subscribe_unknown(self, event: protocol.Subscribe, error: BridgeError) -> None:
        """Subscribe by a type that is not installed here, where the topic has it: its publishers know the definition."""
        with contextlib.suppress(BridgeError):
            if await self._type_of(event.topic) == event.type:
                self._add_subscription(event)
                return
        raise error

    def _add_subscription(self, event: protocol.Subscribe) -> None:
        topic = self._subscribed.get(event.topic)
        if topic is None:
            if len(self._subscribed) >= _MAX_TOPICS:
                raise BridgeError(f"a client may subscribe to {_MAX_TOPICS} topics")
            topic = self._subscribed[event.topic] = ClientTopic(self, self._endpoint, event.topic)
        topic.add(event)
        self.status(StatusLevel.INFO, f"Subscribed to {event.topic}", event.id)

    def _unsubscribe(self, event: protocol.Unsubscribe) -> None:
        topic = self._subscribed.get(event.topic)
        if topic is None:
            return
        topic.remove(event.id)
        if not topic.is_wanted:
            del self._subscribed[event.topic]
            topic.close()
        self.status(StatusLevel.INFO, f"Unsubscribed from {event.topic}", event.id)

    async def _type_of(self, topic: str) -> str:
        """Return the type that a topic has in the graph. Raise BridgeError if it has none."""
        resolved = self._graph.node.resolve(topic)
        if self._graph.snapshot.types.get(resolved, ANY) == ANY:
            await self._graph.look()
        found = self._graph.snapshot.types.get(resolved, ANY)
        if found == ANY:
            raise BridgeError(f"Cannot infer topic type for topic {topic} as it is not yet advertised")
        return found

    # --- services

    def _call_service(self, event: protocol.CallService) -> None:
        if not self._is_allowed("services", event.service, "service, cancelling service call for"):
            return
        if self._calls >= _MAX_CALLS:
            raise BridgeError(f"{_MAX_CALLS} calls are under way: wait for an answer")
        size = self._operation_size
        self._calls += 1
        self._calls_size += size

        def ended(_: object) -> None:
            self._calls -= 1
            self._calls_size -= size
            self.count()

        self._spawn(self._call(event, is_large=self._is_large)).add_done_callback(ended)
        # Last: if this is too much, it ends the client, and with it the call.
        self.count()

    async def _call(self, event: protocol.CallService, *, is_large: bool) -> None:
        try:
            self._require_write("calling services")
            _check_name("service", event.service)
            in_thread = self._endpoint.in_thread if is_large else None
            response = await call(self._graph, event.service, event.arguments, in_thread)
            values: object = conversion.values(response)
            result = True
        except _REFUSALS as error:
            values, result = str(error), False
            self._endpoint.log.warning(
                "[Client %s] call_service %s: %s", self.client.name, event.service, error
            )
        except Exception as error:  # noqa: BLE001 - the client waits for the answer, whatever happened here
            values, result = "the bridge failed on this call", False
            self._reporter.report(error)
        fields = protocol.service_response(event.service, values, event.id, result=result)
        self.send(fields, event.compression, event.fragment_size)

    def _advertise_service(self, event: protocol.AdvertiseService) -> _Work | None:
        if not self._is_allowed("services", event.service, "service, cancelling service advertisement for"):
            return None
        self._require_write("offering services")
        _check_name("service", event.service)
        if sum(each.session is self for each in self._endpoint.services.values()) >= _MAX_SERVICES:
            raise BridgeError(f"a client may offer {_MAX_SERVICES} services")
        return self._offer(event)

    async def _offer(self, event: protocol.AdvertiseService) -> None:
        if event.service in self._endpoint.services:
            self.status(
                StatusLevel.WARNING, f"Duplicate service advertised. Overwriting {event.service}.", event.id
            )
        await self._endpoint.free_service(event.service, "Duplicate advertiser.")
        self._endpoint.services[event.service] = ClientService(self, self._graph, event.service, event.type)
        self.status(StatusLevel.INFO, f"Advertised service {event.service}.", event.id)

    def _unadvertise_service(self, event: protocol.UnadvertiseService) -> _Work:
        service = self._own_service(event.service)
        if service is None:
            raise OperationError(
                f"Service {event.service} has not been advertised via rosbridge, can't unadvertise.", event.id
            )
        why = f"Service {event.service} was unadvertised with a service call in progress"
        closing = self._endpoint.close_service(service, why)
        self.status(StatusLevel.INFO, f"Unadvertised service {event.service}.", event.id)
        return _ended(closing)

    def _service_response(self, event: protocol.ServiceResponse) -> _Work | None:
        service = self._own_service(event.service)
        if service is None:
            raise OperationError(f"Service {event.service} has not been advertised via rosbridge.", event.id)
        if self._is_large:
            return service.answered_large(event, self._endpoint.in_thread)
        service.answered(event)
        return None

    def _own_service(self, name: str) -> ClientService | None:
        service = self._endpoint.services.get(name)
        return service if service and service.session is self else None

    # --- the others

    def _fragment(self, event: protocol.Fragment) -> _Pending | None:
        try:
            text = self._fragments.add(event, asyncio.get_running_loop().time())
        finally:
            self.count()
        return self._begin(text) if text is not None else None

    def _set_level(self, event: protocol.SetLevel) -> None:
        self._level = event.level

    async def _auth(self, event: protocol.Auth) -> None:
        if self._is_authenticated:
            return
        if await authenticate(self._graph.node, event):
            self._is_authenticated = True
            return
        self._endpoint.log.warning("Client %s did not authenticate. Closing connection.", self.client.name)
        self.client.close(_POLICY, "not authenticated")

    def _is_allowed(self, kind: str, name: str, what: str) -> bool:
        """Return whether a name passes the globs; else warn, with rosbridge's text."""
        filters = self._graph.filters
        if (filters.topics if kind == "topics" else filters.services)(self._graph.node.resolve(name)):
            return True
        self.status(StatusLevel.WARNING, f"No match found for {what}: {name}")
        return False

    def _require_write(self, what: str) -> None:
        if not self.client.may_write:
            raise BridgeError(f"{what} is not allowed: this token is read-only")


async def _ended(task: asyncio.Task[None]) -> None:
    await asyncio.wait([task])


def _check_name(kind: str, name: str) -> None:
    why = why_illegal(name)
    if why:
        raise BridgeError(f"{kind} [{name[:200]}]: {why}")


def _conflict(topic: str, wanted: str, known: str) -> BridgeError:
    return BridgeError(
        f"Tried to register topic {topic} with type {wanted} but it is already established with type {known}"
    )


_OPERATIONS: Mapping[type[Event], str] = {
    protocol.Advertise: "advertise",
    protocol.Unadvertise: "unadvertise",
    protocol.Publish: "publish",
    protocol.Subscribe: "subscribe",
    protocol.Unsubscribe: "unsubscribe",
    protocol.CallService: "call_service",
    protocol.ServiceResponse: "service_response",
    protocol.AdvertiseService: "advertise_service",
    protocol.UnadvertiseService: "unadvertise_service",
    protocol.Fragment: "fragment",
    protocol.SetLevel: "set_level",
    protocol.Auth: "auth",
}
