"""The topics that a rosbridge client publishes."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from minirospy.aio.handle import serialized
from minirospy.base.errors import BridgeError
from minirospy.core.idl.protocols import Message, is_stamped
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.web.graph import Publication
from minirospy.web.rosbridge import conversion, protocol
from minirospy.web.rosbridge.operation import MAX_TOPICS, MAX_WAITING_BYTES, Work, check_name, type_conflict
from minirospy.web.rosbridge.topic import MAX_IDS
from minirospy.web.rosbridge.types import message_class

if TYPE_CHECKING:
    from minirospy.web.rosbridge.operation import OperationSession

__all__ = ["ClientPublications"]

_LARGE_LATCHED = 100_000  # bytes; a larger latched message is dropped as soon as its publisher disconnects


@dataclass
class _Published:
    """A topic that a client publishes."""

    publication: Publication
    message_class: type[Message]
    latch: bool = False
    latched: int = 0  # size in bytes of the last message if the topic is latched, otherwise 0
    ids: set[object] = field(default_factory=set)  # ids of the client's advertisements
    # sequence numbers for message headers
    numbers: itertools.count[int] = field(default_factory=lambda: itertools.count(1))


class ClientPublications:
    """The topics that one client publishes. Call the methods in the order of the client's operations."""

    def __init__(self, session: OperationSession) -> None:
        self.latched_size = 0
        """Total bytes of the stored messages of latched topics."""
        self._session = session
        self._published: dict[str, _Published] = {}

    def close(self) -> None:
        """Stop publishing all of the client's topics."""
        for published in self._published.values():
            self._release(published)
        self._published.clear()

    def advertise(self, event: protocol.Advertise) -> None:
        if not self._session.is_allowed("topics", event.topic, "topic, cancelling advertisement of"):
            return
        published = self._published.get(event.topic) or self._open(event.topic, event.type, event.latch)
        if published.message_class is not message_class(event.type):
            raise type_conflict(event.topic, event.type, published.message_class._type)
        if event.id not in published.ids and len(published.ids) >= MAX_IDS:
            raise BridgeError(f"a client may advertise a topic {MAX_IDS} times")
        published.ids.add(event.id)

    def unadvertise(self, event: protocol.Unadvertise) -> None:
        published = self._published.get(event.topic)
        if published is None:
            return
        if event.id is None:
            published.ids.clear()
        published.ids.discard(event.id)
        if not published.ids:
            del self._published[event.topic]
            self.latched_size -= published.latched
            self._release(published)
            self._session.count()

    def _release(self, published: _Published) -> None:
        """Release a publication after a delay, so that the client can advertise its topic again in the meantime.

        Release it immediately if it stores a large message.
        """
        if published.latched > _LARGE_LATCHED:
            published.publication.close()
        else:
            self._session.shared.release(published.publication)

    def publish(self, event: protocol.Publish) -> Work | None:
        if not self._session.is_allowed("topics", event.topic, "topic, cancelling publish to"):
            return None
        published = self._published.get(event.topic)
        if published is None:
            return self._publish_established(event)
        return self._publish_to(published, event)

    async def _publish_established(self, event: protocol.Publish) -> None:
        """Publish on a topic that the client has not advertised, using the type in the graph."""
        type_ = await self._session.type_of(event.topic)
        published = self._open(event.topic, type_, event.latch)
        published.ids.add(None)
        pending = self._publish_to(published, event)
        if pending is not None:
            await pending

    def _publish_to(self, published: _Published, event: protocol.Publish) -> Work | None:
        if self._session.is_large:
            return self._publish_large(published, event)
        body = self._body(published, event)
        self._count_latched(published, body)
        if published.publication.has_joined:
            published.publication.publish(body)
            return None
        return self._publish_when_joined(published.publication, body)

    async def _publish_large(self, published: _Published, event: protocol.Publish) -> None:
        body = await self._session.shared.in_thread(lambda: self._body(published, event))
        self._count_latched(published, body)
        await self._publish_when_joined(published.publication, body)

    def _count_latched(self, published: _Published, body: bytes) -> None:
        """Count the memory of a message that is kept because its topic is latched.

        Raise BridgeError if the client's latched messages exceed the limit.
        """
        if not published.latch:
            return
        grown = len(body) - published.latched
        if self.latched_size + grown > MAX_WAITING_BYTES:
            raise BridgeError(f"a client may have {MAX_WAITING_BYTES} bytes of latched messages")
        self.latched_size += grown
        published.latched = len(body)
        self._session.count()

    def _body(self, published: _Published, event: protocol.Publish) -> bytes:
        message = published.message_class()
        conversion.fill(message, event.message, self._session.graph.node.now)
        if is_stamped(message):
            message.header.seq = next(published.numbers)
        return serialized(message)

    async def _publish_when_joined(self, publication: Publication, body: bytes) -> None:
        await publication.joined()
        publication.publish(body)

    def _open(self, topic: str, type_: str, latch: bool) -> _Published:
        self._session.require_write("publishing")
        check_name("topic", topic)
        if len(self._published) >= MAX_TOPICS:
            raise BridgeError(f"a client may publish {MAX_TOPICS} topics")
        found = message_class(type_)
        resolved = self._session.graph.node.resolve(topic)
        known = self._session.graph.snapshot.types.get(resolved, ANY)
        if known not in (ANY, found._type):
            raise type_conflict(topic, found._type, known)
        publication = self._session.graph.advertise(resolved, InterfaceType.of(found), latch=latch)
        published = self._published[topic] = _Published(publication, found, latch)
        return published
