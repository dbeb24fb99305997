"""A topic that a robot subscribes to. It is published locally while another gateway offers it."""

from __future__ import annotations

import contextlib
import logging
import time
from collections import deque
from collections.abc import Callable, Coroutine, Mapping
from typing import TYPE_CHECKING

from minirospy.aio.raw import call_raw, raw_class
from minirospy.aio.topics import Publisher
from minirospy.base.errors import BridgeError, DeserializationError, ROSException, ServiceException
from minirospy.core.idl.protocols import Message
from minirospy.fleet.definitions import Definitions
from minirospy.fleet.frames import FrameRewriter, stripped
from minirospy.fleet.keys import UNKNOWN_MD5, Offer, ServiceToken, TopicToken
from minirospy.fleet.network import QueryFailed
from minirospy.fleet.rules import STOP_SECONDS
from minirospy.fleet.stopping import CommandStream
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["InboundTopic", "call_service", "run_on_loop"]

_log = logging.getLogger(__name__)
_IDLE_SECONDS = 10.0
_QUEUE = 100
_MAX_HELD, _MAX_HELD_BYTES = 100, 16 << 20
_MAX_OFFERS = 100


async def call_service(node: Node, token: ServiceToken, request: bytes) -> bytes:
    """Call a local service for a remote client and return the response. Raise QueryFailed if the call fails."""
    try:
        return await call_raw(node, token.service, token.md5sum, request)
    except ServiceException as error:
        raise QueryFailed(str(error)) from error


def run_on_loop(node: Node, work: Coroutine[object, object, None]) -> None:
    """Run a coroutine on a node's loop; wait at most ten seconds until it has finished. Ignore its exceptions.

    Waiting keeps further messages in the receiver's queue while the loop is slow.
    """
    done = node.run_threadsafe(work)
    with contextlib.suppress(Exception):
        done.result(10.0)


class InboundTopic:
    """Publishes inbound messages on a local topic. Buffers them until the robot's subscribers are connected."""

    def __init__(
        self,
        node: Node,
        definitions: Definitions,
        token: TopicToken,
        spawn: Callable[[Coroutine[object, object, None]], object],
        strips_frames: bool,
        *,
        headers: Mapping[str, str] | None = None,
        on_change: Callable[[], object] | None = None,
        stop_seconds: float = STOP_SECONDS,
    ) -> None:
        """Create the topic.

        ``headers`` contains extra fields for the connection header; ``on_change`` is passed to :meth:`Node.advertise`.

        A zero velocity is published if a stream of velocities stops for ``stop_seconds``; 0 disables this.
        """
        self.token = token
        self.passed = 0
        self._node = node
        self._definitions = definitions
        self._spawn = spawn
        self._strips_frames = strips_frames
        self._headers = headers
        self._on_change = on_change
        self._change = stripped(token.robot)
        self._offers: set[Offer] = set()
        self._last = time.monotonic()
        self._md5sum = ""
        self._publisher: Publisher[Message] | None = None
        self._rewriter: FrameRewriter | None = None
        self._is_ready = False
        self._is_closed = False
        self._misfits = RateLimitedLogger(_log)
        self._held: deque[bytes] = deque(maxlen=_MAX_HELD)
        self._stream: CommandStream | None = None
        self._stop_seconds = stop_seconds

    @property
    def is_idle(self) -> bool:
        """Return whether no writer offers the topic and no message has arrived recently, so that it can be closed."""
        return not self._offers and time.monotonic() - self._last > _IDLE_SECONDS

    @property
    def has_subscribers(self) -> bool:
        """Return whether nodes other than this one are connected to the topic."""
        own = self._node.name
        return self._publisher is not None and any(peer != own for peer in self._publisher.subscribers)

    def offer_changed(self, offer: Offer, is_there: bool) -> None:
        """Record an offer or its withdrawal. Publish the topic while any writer offers it."""
        self._last = time.monotonic()
        if not is_there:
            self._offers.discard(offer)
        elif offer.type == self.token.type and len(self._offers) < _MAX_OFFERS:
            self._offers.add(offer)
            self._prepare(offer.md5sum, offer.writer)

    def publish(self, md5sum: str, body: bytes) -> bool:
        """Publish a message; return False if the topic is not ready. May be called from any thread."""
        publisher = self._publisher
        if publisher is None or not self._is_ready or md5sum != self._md5sum:
            return False
        self._put(publisher, body)
        return True

    def keep(self, md5sum: str, writer: str, body: bytes) -> None:
        """Buffer a message that arrived before the topic was ready. Runs on the loop."""
        if self.publish(md5sum, body):
            return
        self._prepare(md5sum, writer)
        if md5sum == self._md5sum:
            self._held.append(body)
            while len(self._held) > 1 and sum(map(len, self._held)) > _MAX_HELD_BYTES:
                self._held.popleft()

    async def close(self) -> None:
        """Stop publishing. Idempotent."""
        publisher, self._publisher = self._publisher, None
        self._is_ready = False
        self._is_closed = True
        if self._stream:
            with contextlib.suppress(ROSException):  # the node has been shut down
                self._stream.close()
        if publisher:
            if self._on_change is not None and self._on_change in publisher.on_change:
                publisher.on_change.remove(self._on_change)
            await publisher.close()

    def _prepare(self, md5sum: str, writer: str) -> None:
        # A topic has a single type: the type known locally or, if there is none, that of the first writer.
        if self._md5sum or self.token.md5sum not in (UNKNOWN_MD5, md5sum):
            return
        self._md5sum = md5sum
        self._spawn(self._open(md5sum, writer))

    async def _open(self, md5sum: str, writer: str) -> None:
        interface = await self._definitions.interface(self.token.type, md5sum, writer)
        if self._strips_frames:
            self._rewriter = await self._definitions.rewriter(self.token.type, md5sum)
        if self._is_closed:
            return  # the topic was closed during the query for the definition
        is_latched = any(offer.is_latched for offer in self._offers)

        try:
            publisher = self._node.advertise(
                self.token.topic,
                raw_class(interface),
                queue_size=_QUEUE,
                latch=is_latched,
                headers=self._headers,
                on_change=self._on_change,
            )
        except ValueError as error:
            self._misfits.warning("%s", error)
            return
        if self._stop_seconds and CommandStream.guards(self.token.type):
            self._stream = CommandStream(
                self.token.topic, self.token.type, publisher.publish_raw, self._stop_seconds
            )
        self._publisher = publisher
        await publisher.wait_for_expected()
        # Publish the buffered messages first: the receiver's thread passes newer ones to `keep`, which runs on this loop.
        for body in self._held:
            self._put(publisher, body)
        self._held.clear()
        self._is_ready = self._publisher is publisher

    def _put(self, publisher: Publisher[Message], body: bytes) -> None:
        self._last = time.monotonic()
        try:
            if self._rewriter:
                body = self._rewriter.rewritten(body, self._change)
            if self._stream:
                self._stream.publish(body)
            else:
                publisher.publish_raw(body)
        except (ROSException, DeserializationError, BridgeError) as error:
            _log.debug("a message to %s: %s", self.token.topic, error)
        else:
            self.passed += 1
