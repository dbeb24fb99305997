"""A node's publishers and subscriptions in an event loop. Messages are serialized and deserialized on the loop."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import weakref
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import TYPE_CHECKING, Generic, TypeVar

from minirospy.aio.handle import Handle, pieces_of, registered
from minirospy.base.errors import MasterUnreachableError, ROSException, ROSInterruptException, RpcError
from minirospy.core.idl.message import args_kwds_to_message
from minirospy.core.idl.protocols import Message, declared, is_stamped
from minirospy.core.wire.framing import CHUNK, Frame, LargeFrame, serialize_frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.subscription import Subscription as RuntimeSubscription
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.aio.raw import RawSubscription

__all__ = ["PublishedTopic", "Publisher", "SubscribedTopic", "Subscription"]

_M_co = TypeVar("_M_co", bound=Message, covariant=True)
JOIN_SECONDS = 1.0


class Subscription(Handle, Generic[_M_co]):
    """The messages on a topic, to iterate over with ``async for``; created by :meth:`Node.subscribe`.

    The iteration ends when the subscription is closed or the node shuts down.
    """

    def __init__(
        self, node: Node, state: SubscribedTopic, message_class: type[_M_co], queue_size: int
    ) -> None:
        self.topic = state.topic
        self.dropped = 0  # number of messages dropped in favour of newer ones
        self._node = node
        self._message_class = message_class
        self._misfits = RateLimitedLogger(node.log)
        self._takes_memoryview = bool(declared(message_class, "deserialize", "_takes_memoryview"))
        self._queue: deque[tuple[bytes | memoryview, Header]] = deque(maxlen=queue_size)
        self._arrived = asyncio.Event()
        self._ended = node.is_shutdown
        self._state = state
        self._registration = state.join(self)

    def __aiter__(self) -> AsyncIterator[_M_co]:
        return self

    async def __anext__(self) -> _M_co:
        while True:
            while not self._queue:
                if self._ended:
                    raise StopAsyncIteration
                self._arrived.clear()
                await self._arrived.wait()
            message = self._deserialized(*self._queue.popleft())
            if message is not None:
                return message

    async def next(self, timeout: float | None = None) -> _M_co:
        """Return the next message.

        Raise TimeoutError after ``timeout`` seconds, ROSInterruptException if the subscription is closed.
        """
        try:
            return await asyncio.wait_for(self.__anext__(), timeout)
        except asyncio.TimeoutError:
            text = f"timeout exceeded while waiting for message on topic {self.topic}"
            raise TimeoutError(text) from None
        except StopAsyncIteration:
            raise ROSInterruptException("rospy shutdown") from None

    @property
    def num_connections(self) -> int:
        """Return the number of connected publishers."""
        return len(self._state.subscription.links)

    async def wait_for_publishers(self, count: int = 1, timeout: float | None = None) -> None:
        """Wait until ``count`` publishers are connected.

        Raise TimeoutError after ``timeout`` seconds, ROSInterruptException if the subscription is closed.
        """
        connected = asyncio.Event()
        callbacks = self._state.subscription.on_connected
        callbacks.append(connected.set)
        try:
            await asyncio.wait_for(self._wait_for(count, connected), timeout)
        except asyncio.TimeoutError:
            text = f"timeout exceeded while waiting for {count} publishers of topic {self.topic}"
            raise TimeoutError(text) from None
        finally:
            callbacks.remove(connected.set)

    async def close(self) -> None:
        """Unsubscribe. Messages that have already arrived can still be read. Idempotent."""
        self._end()
        await self._state.leave(self)

    async def _wait_for(self, count: int, connected: asyncio.Event) -> None:
        while self.num_connections < count:
            if self._ended:
                raise ROSInterruptException("rospy shutdown")
            await connected.wait()
            connected.clear()

    def _put(self, frame: bytes | memoryview, header: Header) -> None:
        if len(self._queue) == self._queue.maxlen:
            self.dropped += 1
        self._queue.append((frame, header))
        self._arrived.set()

    def _end(self) -> None:
        self._ended = True
        self._arrived.set()
        # Wake the tasks that wait for publishers; they then check again.
        for callback in self._state.subscription.on_connected:
            callback()

    def _deserialized(self, frame: bytes | memoryview, header: Header) -> _M_co | None:
        message = self._message_class()
        try:
            message.deserialize(frame if self._takes_memoryview else bytes(frame))
        except Exception as error:  # noqa: BLE001 - a third-party class may raise any error on invalid bytes
            self._misfits.error(
                "a message on %s from %s does not fit %s: %s",
                self.topic,
                header.get("callerid"),
                message._type,
                f"no memory for its {len(frame)} bytes" if isinstance(error, MemoryError) else error,
            )
            return None
        message._connection_header = header
        return message


class Publisher(Handle, Generic[_M_co]):
    """Publishes messages on a topic; created by :meth:`Node.advertise`."""

    def __init__(self, node: Node, state: PublishedTopic, message_class: type[_M_co], *, waits: bool) -> None:
        self.topic = state.publication.topic
        self._node = node
        self._message_class = message_class
        self._waits = waits
        self._state: PublishedTopic | None = state
        self._registration = state.join(self)

    def publish_raw(self, body: bytes) -> None:
        """Publish a message that is already serialized, without waiting. Raise ROSException if the publisher is closed."""
        state = self._state
        if state is None or self._node.is_shutdown:
            raise ROSException("publish() to a closed topic")
        publication = state.publication
        if publication.links or publication.latch:
            large = len(body) >= CHUNK
            publication.publish(LargeFrame((body,), len(body)) if large else serialize_frame(body))

    async def publish(self, *args: object, **kwds: object) -> None:
        """Publish a message, or a message with the given field values.

        Wait for slow subscribers only with ``queue_size=None``. Raise ROSException if the publisher is closed,
        ROSSerializationException or TypeError if a value is invalid.
        """
        if not self._registration.done():
            await self
        state = self._state
        if state is None or self._node.is_shutdown:
            raise ROSException("publish() to a closed topic")
        state.publish(args_kwds_to_message(self._message_class, args, kwds))
        if self._waits:
            for link in state.publication.links:
                await link.drain(float("inf"))

    @property
    def num_connections(self) -> int:
        """Return the number of connected subscribers."""
        return len(self._state.publication.links) if self._state else 0

    @property
    def on_change(self) -> list[Callable[[], object]]:
        """The functions to call on the loop when a subscriber has connected or disconnected."""
        return self._state.on_change if self._state else []

    @property
    def subscribers(self) -> list[str]:
        """Return the node names of the connected subscribers."""
        return [link.peer for link in self._state.publication.links] if self._state else []

    def forget_latched(self) -> None:
        """Stop sending the last message to new subscribers."""
        if self._state:
            self._state.publication.forget_latched()

    async def wait_for_subscribers(self, count: int = 1, timeout: float | None = None) -> None:
        """Wait until ``count`` subscribers are connected.

        Raise TimeoutError after ``timeout`` seconds, ROSInterruptException if the node shuts down.
        """
        try:
            await asyncio.wait_for(self._wait_for(count), timeout)
        except asyncio.TimeoutError:
            text = f"timeout exceeded while waiting for {count} subscribers of topic {self.topic}"
            raise TimeoutError(text) from None

    async def wait_for_expected(self) -> None:
        """Wait up to a second for the subscribers that the master listed at registration to connect."""
        await self
        state = self._state
        if state is None:
            return  # the topic was closed while registering
        with contextlib.suppress(asyncio.TimeoutError, ROSInterruptException):
            await asyncio.wait_for(self._wait_for(state.publication.expected), JOIN_SECONDS)

    async def close(self) -> None:
        """Stop publishing. Closing the node's last publisher on a topic also unregisters the topic. Idempotent."""
        state, self._state = self._state, None
        if state:
            await state.leave(self)

    async def _wait_for(self, count: int) -> None:
        while self._state and self.num_connections < count:
            if self._node.is_shutdown:
                raise ROSInterruptException("rospy shutdown")
            await self._state.next_change()


class SubscribedTopic:
    """A topic that a node subscribes to. Its subscriptions share this object."""

    def __init__(self, node: Node, topic: str, message_class: type[Message]) -> None:
        self.topic = topic
        self._node = node
        self._handles: weakref.WeakSet[Subscription[Message] | RawSubscription] = weakref.WeakSet()
        runtime = node._node
        self.subscription: RuntimeSubscription = runtime.make_subscription(
            topic, InterfaceType.of(message_class), self._deliver, on_loop=True
        )
        self._registration = node._spawn(
            registered(
                runtime.subscribe, self.subscription, f"subscription [{topic}]", node.registration_faults
            )
        )

    def join(self, handle: Subscription[Message] | RawSubscription) -> asyncio.Task[None]:
        self._handles.add(handle)
        # Leave the topic when the subscription is garbage-collected: leaving `async for` by `break` does not close it.
        weakref.finalize(handle, self._node._later, self._leave_if_empty).atexit = False
        return self._registration

    async def leave(self, handle: Subscription[Message] | RawSubscription) -> None:
        self._handles.discard(handle)
        try:
            await self._leave_if_empty()
        except asyncio.CancelledError:
            self._node._later(self._leave_if_empty)
            raise

    def end(self) -> None:
        for handle in list(self._handles):
            handle._end()

    async def _leave_if_empty(self) -> None:
        # Another subscription may be added while this waits.
        await asyncio.wait([self._registration])
        if self._handles or self._node._subscribed.get(self.topic) is not self:
            return
        del self._node._subscribed[self.topic]
        with contextlib.suppress(MasterUnreachableError, RpcError):
            await self._node._node.unsubscribe(self.subscription)

    def _deliver(self, frame: Frame, header: Header) -> None:
        # Copy a small frame, because the next receive overwrites its buffer.
        kept = frame if len(frame) > CHUNK else bytes(frame)
        for handle in list(self._handles):
            handle._put(kept, header)


class PublishedTopic:
    """A topic that a node publishes. Its publishers share this object."""

    def __init__(self, node: Node, publication: Publication, message_class: type[Message]) -> None:
        self.publication = publication
        self._node = node
        self._handles: set[Publisher[Message]] = set()
        self._sequence = itertools.count(1)
        self._has_header = bool(getattr(message_class, "_has_header", False))
        self._changed = asyncio.Event()
        # Called on the loop when a subscriber has connected or disconnected
        self.on_change: list[Callable[[], object]] = []
        self._registration = node._spawn(
            registered(
                node._node.advertise,
                publication,
                f"publication [{publication.topic}]",
                node.registration_faults,
            )
        )

    def join(self, handle: Publisher[Message]) -> asyncio.Task[None]:
        self._handles.add(handle)
        return self._registration

    async def leave(self, handle: Publisher[Message]) -> None:
        self._handles.discard(handle)
        self.links_changed()
        try:
            await self._leave_if_empty()
        except asyncio.CancelledError:
            self._node._later(self._leave_if_empty)
            raise

    async def _leave_if_empty(self) -> None:
        # Another publisher may be added while this waits.
        await asyncio.wait([self._registration])
        for link in self.publication.links:
            if not self._handles:
                await link.drain(JOIN_SECONDS)
        topic = self.publication.topic
        if self._handles or self._node._published.get(topic) is not self:
            return
        del self._node._published[topic]
        with contextlib.suppress(MasterUnreachableError, RpcError):
            await self._node._node.unadvertise(self.publication)

    def publish(self, message: Message) -> None:
        """Send a message to all subscribers. Thread-safe."""
        if self.publication.links or self.publication.latch:
            if self._has_header:
                assert is_stamped(message)
                message.header.seq = next(self._sequence)
            self.publication.publish(pieces_of(message).frame())

    def links_changed(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()
        for callback in self.on_change:
            callback()

    async def next_change(self) -> None:
        """Wait until a subscriber has connected or disconnected."""
        await self._changed.wait()
