"""A topic of a robot that somebody wants: subscribed here, sent to the fleet."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from minirospy.aio.raw import RawSubscription
from minirospy.bridge.fleet.frames import FrameRewriter, prefixed
from minirospy.bridge.fleet.keys import TopicToken, out_key, replay_key
from minirospy.bridge.fleet.sender import Outflow
from minirospy.errors import DeserializationError
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger
from minirospy.wire.framing import Frame
from minirospy.wire.header import Header

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["OutboundTopic"]

_log = logging.getLogger(__name__)
_MOST_LATCHED = 100


class OutboundTopic:
    """Sends a topic's messages, and its latched ones again to each reader that comes later."""

    def __init__(
        self, node: Node, token: TopicToken, outflow: Outflow, rewriter: FrameRewriter | None
    ) -> None:
        self.token = token
        self.outflow = outflow
        self._node = node
        self._rewriter = rewriter
        self._change = prefixed(token.robot)
        self._latched: dict[int, bytes] = {}
        self._key = out_key(token.robot, token.gateway, token.md5sum, token.topic)
        self._misfits = RateLimitedLogger(_log)
        self._subscription: RawSubscription | None = None

    def open(self) -> None:
        """Subscribe to the topic."""
        self._subscription = self._node.subscribe_raw(self.token.topic, self._deliver)

    async def close(self) -> None:
        """Unsubscribe. Idempotent."""
        subscription, self._subscription = self._subscription, None
        if subscription:
            await subscription.close()
        self.outflow.close()

    def replay(self, reader: str) -> None:
        """Send the latched messages to a reader that has come later."""
        self._forget_disconnected()
        token = self.token
        key = replay_key(token.robot, token.gateway, token.md5sum, token.topic, reader)
        for body in self._latched.values():
            self.outflow.send(key, body, always=True)

    def _deliver(self, frame: Frame, header: Header) -> None:
        if header.get("callerid") == self._node.name or header.get("md5sum") != self.token.md5sum:
            return
        body = bytes(frame)
        if self._rewriter:
            try:
                body = self._rewriter.rewritten(body, self._change)
            except DeserializationError as error:
                self._misfits.error("a message on %s: %s", self.token.topic, error)
                return
        is_latched = header.get("latching") == "1"
        if is_latched:
            self._forget_disconnected()
            if len(self._latched) < _MOST_LATCHED or id(header) in self._latched:
                self._latched[id(header)] = body
        self.outflow.send(self._key, body, always=is_latched)

    def _forget_disconnected(self) -> None:
        present = {id(header) for header in self._subscription.headers} if self._subscription else set()
        self._latched = {key: body for key, body in self._latched.items() if key in present}
