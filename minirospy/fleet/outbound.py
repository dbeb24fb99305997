"""Subscribes to a robot's topic and sends its messages to the fleet's readers."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

from minirospy.aio.raw import RawSubscription
from minirospy.base.errors import DeserializationError
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.fleet.frames import FrameRewriter, prefixed
from minirospy.fleet.keys import TopicToken, out_key
from minirospy.fleet.sender import Outflow
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["OutboundTopic"]

_log = logging.getLogger(__name__)
_MAX_LATCHED = 100


class OutboundTopic:
    """Sends a topic's messages to the fleet, and resends latched messages to each reader that joins later."""

    def __init__(
        self,
        node: Node,
        token: TopicToken,
        outflow: Outflow,
        rewriter: FrameRewriter | None = None,
        *,
        key: str = "",
        is_left_out: Callable[[Header], bool] = lambda _: False,
    ) -> None:
        """Create the topic.

        ``key`` is the key for the messages, or "" for the fleet's own key. With a key, the topic need not have a
        publisher yet.

        ``is_left_out(header)`` returns whether to ignore a publisher's messages.
        """
        self.token = token
        self.outflow = outflow
        self._node = node
        self._rewriter = rewriter
        self._change = prefixed(token.robot)
        self._latched: dict[int, bytes] = {}
        self._key = key or out_key(token.robot, token.gateway, token.md5sum, token.topic)
        self._is_typed = bool(key)
        self._is_left_out = is_left_out
        self._misfits = RateLimitedLogger(_log)
        self._subscription: RawSubscription | None = None

    def open(self) -> None:
        """Subscribe to the topic."""
        type_ = InterfaceType(self.token.type, self.token.md5sum) if self._is_typed else None
        self._subscription = self._node.subscribe_raw(self.token.topic, self._deliver, type_=type_)

    async def close(self) -> None:
        """Unsubscribe. Idempotent."""
        subscription, self._subscription = self._subscription, None
        if subscription:
            await subscription.close()
        self.outflow.close()

    def replay(self, key: str) -> None:
        """Resend the latched messages on ``key``, which only the new reader subscribes to."""
        self._forget_disconnected()
        for body in self._latched.values():
            self.outflow.send(key, body, always=True)

    def _deliver(self, frame: Frame, header: Header) -> None:
        if header.get("callerid") == self._node.name or header.get("md5sum") != self.token.md5sum:
            return
        if self._is_left_out(header):
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
            if len(self._latched) < _MAX_LATCHED or id(header) in self._latched:
                self._latched[id(header)] = body
        self.outflow.send(self._key, body, always=is_latched)

    def _forget_disconnected(self) -> None:
        present = {id(header) for header in self._subscription.headers} if self._subscription else set()
        self._latched = {key: body for key, body in self._latched.items() if key in present}
