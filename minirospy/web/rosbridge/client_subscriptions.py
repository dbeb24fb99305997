"""The topics that a rosbridge client subscribes to."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from minirospy.base.errors import BridgeError
from minirospy.core.wire.tcpros import ANY
from minirospy.web.rosbridge import protocol
from minirospy.web.rosbridge.operation import MAX_TOPICS, Work, check_name, type_conflict
from minirospy.web.rosbridge.protocol import StatusLevel
from minirospy.web.rosbridge.topic import ClientTopic
from minirospy.web.rosbridge.types import message_class

if TYPE_CHECKING:
    from minirospy.web.rosbridge.operation import OperationSession

__all__ = ["ClientSubscriptions"]


class ClientSubscriptions:
    """One client's subscriptions, keyed by topic. Call the methods in the order of the client's operations."""

    def __init__(self, session: OperationSession) -> None:
        self._session = session
        self._subscribed: dict[str, ClientTopic] = {}

    def close(self) -> None:
        """Cancel all subscriptions of the client."""
        for topic in self._subscribed.values():
            topic.close()
        self._subscribed.clear()

    def subscribe(self, event: protocol.Subscribe) -> Work | None:
        if not self._session.is_allowed("topics", event.topic, "topic, cancelling subscription to"):
            return None
        check_name("topic", event.topic)
        is_known = event.topic in self._subscribed
        if event.compression == "cbor-raw" or (is_known and event.type is None):
            self._add(event)
            return None
        if event.type is None:
            return self._subscribe_established(event)
        try:
            declared = message_class(event.type)._type
        except BridgeError as error:
            return self._subscribe_unknown(event, error)
        known = self._session.graph.snapshot.types.get(self._session.graph.node.resolve(event.topic), ANY)
        if known not in (ANY, declared):
            raise type_conflict(event.topic, declared, known)
        self._add(event)
        return None

    async def _subscribe_established(self, event: protocol.Subscribe) -> None:
        await self._session.type_of(event.topic)
        self._add(event)

    async def _subscribe_unknown(self, event: protocol.Subscribe, error: BridgeError) -> None:
        """Subscribe with a type that is not installed, if the topic has this type: the topic's publishers send the definition."""
        with contextlib.suppress(BridgeError):
            if await self._session.type_of(event.topic) == event.type:
                self._add(event)
                return
        raise error

    def _add(self, event: protocol.Subscribe) -> None:
        topic = self._subscribed.get(event.topic)
        if topic is None:
            if len(self._subscribed) >= MAX_TOPICS:
                raise BridgeError(f"a client may subscribe to {MAX_TOPICS} topics")
            topic = self._subscribed[event.topic] = ClientTopic(
                self._session, self._session.shared, event.topic
            )
        topic.add(event)
        self._session.status(StatusLevel.INFO, f"Subscribed to {event.topic}", event.id)

    def unsubscribe(self, event: protocol.Unsubscribe) -> None:
        topic = self._subscribed.get(event.topic)
        if topic is None:
            return
        topic.remove(event.id)
        if not topic.is_wanted:
            del self._subscribed[event.topic]
            topic.close()
        self._session.status(StatusLevel.INFO, f"Unsubscribed from {event.topic}", event.id)
