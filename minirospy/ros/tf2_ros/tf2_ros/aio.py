"""Transforms for asyncio programs: tf2_ros's buffer, listener and broadcasters as coroutines, on a `minirospy.Node`.

::

    async with Buffer(node) as buffer:
        found = await buffer.lookup("map", "laser", timeout=2.0)
        async for pose in buffer.changes("map", "base"):
            print(pose.transform.translation.x)

All objects belong to the node's event loop. Source: http://wiki.ros.org/tf2_ros. Examples: docs/tf.md.
"""

from __future__ import annotations

import asyncio
import contextlib
import time as clocks
from collections.abc import AsyncIterator, Callable, Coroutine
from types import TracebackType
from typing import Literal, TypeVar

from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from minirospy import Node
from minirospy.aio import Publisher, Subscription
from minirospy.base import times
from minirospy.base.errors import (
    DeserializationError,
    InvalidArgumentException,
    ROSInterruptException,
    TransformException,
)
from minirospy.core.tf2.buffer import StampedTransform, TransformBuffer
from minirospy.core.tf2.insertion import RefusalLog
from minirospy.core.tf2.listing import frames_as_yaml
from minirospy.ros.tf2_ros.tf2_ros.messages import LazyTFMessage, Moment, nanoseconds, transform_stamped

__all__ = ["Broadcaster", "Buffer"]

_T = TypeVar("_T")
_LATEST = times.Time()
# maximum number of queued messages; if the program is busy, older ones are dropped
_MAX_WAITING = 1000


class Buffer:
    """The transforms received on /tf and /tf_static in the last ``cache_time`` seconds.

    The buffer receives transforms inside ``async with Buffer(node) as buffer:``. If time jumps back, all non-static transforms
    are removed.
    """

    def __init__(self, node: Node, cache_time: float = 10.0) -> None:
        self._node = node
        refusals = RefusalLog(self._log, clocks.monotonic)
        self.tree = TransformBuffer(int(cache_time * 1e9), refusals)
        self._changed = asyncio.Event()
        self._last = 0
        self._listening: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> Buffer:
        await self.start()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def start(self) -> None:
        """Start receiving transforms; ``async with`` calls this method first."""
        for topic, is_static in (("/tf", False), ("/tf_static", True)):
            subscription = await self._node.subscribe(topic, LazyTFMessage, queue_size=_MAX_WAITING)
            self._listening.append(asyncio.create_task(self._take(subscription, is_static)))

    async def close(self) -> None:
        """Stop receiving transforms. Transforms received so far can still be looked up. Idempotent."""
        listening, self._listening = self._listening, []
        for task in listening:
            task.cancel()
        await asyncio.gather(*listening, return_exceptions=True)

    # --- lookups

    async def lookup(
        self, target: str, source: str, time: Moment = _LATEST, *, timeout: float | None = 0.0
    ) -> TransformStamped:
        """Return the pose of the frame ``source`` in the frame ``target`` at ``time`` (default: the latest pose).

        Wait up to ``timeout`` seconds of the node's time for the transform (None: until the node shuts down). Raise
        LookupException if a frame is unknown, ConnectivityException if the frames are not connected,
        ExtrapolationException if there is no data for ``time``, InvalidArgumentException if a frame name is invalid, and
        ROSInterruptException if the node shuts down in the meantime.
        """
        stamp = nanoseconds(time)
        found = await self._wait_for(lambda: self.tree.lookup(target, source, stamp), timeout)
        return transform_stamped(target, source, found)

    async def lookup_full(
        self,
        target: str,
        target_time: Moment,
        source: str,
        source_time: Moment,
        fixed: str,
        *,
        timeout: float | None = 0.0,
    ) -> TransformStamped:
        """Return the pose of ``source`` at ``source_time``, relative to ``target`` at ``target_time``, via the frame ``fixed``.

        The frame ``fixed`` is assumed not to move between the two times. Wait and raise exceptions like :meth:`lookup`.
        """
        stamps = nanoseconds(target_time), nanoseconds(source_time)
        found = await self._wait_for(
            lambda: self.tree.lookup_full(target, stamps[0], source, stamps[1], fixed), timeout
        )
        return transform_stamped(target, source, found)

    def why_not(self, target: str, source: str, time: Moment = _LATEST) -> str | None:
        """Return the reason why :meth:`lookup` would fail now, or None if it would succeed."""
        try:
            return self.tree.why_not(target, source, nanoseconds(time))
        except InvalidArgumentException as error:
            return str(error)

    async def changes(self, target: str, source: str) -> AsyncIterator[TransformStamped]:
        """Yield the latest pose of ``source`` in ``target``, then each new pose; a busy program misses intermediate poses.

        Stop when the node shuts down. Raise InvalidArgumentException if a frame name is invalid.
        """
        # Raises InvalidArgumentException for invalid frame names.
        self.tree.why_not(target, source, 0)
        end = asyncio.ensure_future(self._node.spin())
        last: StampedTransform | None = None
        try:
            while not self._node.is_shutdown:
                changed = self._changed
                with contextlib.suppress(TransformException):
                    found = self.tree.lookup(target, source, 0)
                    if found != last:
                        last = found
                        yield transform_stamped(target, source, found)
                        continue
                await _first_of(changed, end)
        finally:
            end.cancel()

    def frames_as_yaml(self) -> str:
        """Return each frame's parent, broadcaster, rate and times, in the format that view_frames reads."""
        return frames_as_yaml(self.tree)

    # --- internal

    async def _wait_for(self, look: Callable[[], _T], timeout: float | None) -> _T:
        try:
            return look()
        except InvalidArgumentException:
            raise
        except TransformException:
            if timeout is not None and timeout <= 0:
                raise

        pause = self._node.spin() if timeout is None else self._node.sleep(timeout)
        deadline = asyncio.ensure_future(_quietly(pause))
        try:
            while True:
                changed = self._changed
                try:
                    return look()
                except TransformException:
                    if self._node.is_shutdown:
                        raise ROSInterruptException("rospy shutdown") from None
                    if deadline.done():
                        raise
                await _first_of(changed, deadline)
        finally:
            deadline.cancel()

    async def _take(self, subscription: Subscription[LazyTFMessage], is_static: bool) -> None:
        async with subscription:
            async for message in subscription:
                self.check_for_jump()
                who = message._connection_header.get("callerid", "default_authority")
                try:
                    self.tree.insert_message(message.raw or b"", who, is_static=is_static)
                except DeserializationError as error:
                    self._node.log.error("a message of %s is not a tf2_msgs/TFMessage: %s", who, error)
                    continue
                self._changed.set()
                self._changed = asyncio.Event()

    def check_for_jump(self) -> None:
        now = self._node.now().to_nsec()
        if now < self._last:
            jump = (self._last - now) / 1e9
            self._node.log.warning("Detected jump back in time of %fs. Clearing TF buffer.", jump)
            self.tree.clear()
        self._last = now

    def _log(self, text: str, is_error: bool) -> None:
        (self._node.log.error if is_error else self._node.log.warning)("%s", text)


class Broadcaster:
    """Publishes transforms on /tf, and static transforms on /tf_static."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.moving: Publisher[TFMessage] | None = None
        self._static: Publisher[TFMessage] | None = None
        self._kept: dict[str, TransformStamped] = {}

    async def send(self, *transforms: TransformStamped) -> None:
        """Publish transforms in one message on /tf."""
        if self.moving is None:
            self.moving = self._node.advertise("/tf", TFMessage, queue_size=100)
        await self.moving.publish(TFMessage(list(transforms)))

    async def send_static(self, *transforms: TransformStamped) -> None:
        """Publish transforms on the latched topic /tf_static, together with all earlier ones.

        A transform replaces earlier ones for its child frame.
        """
        if self._static is None:
            self._static = self._node.advertise("/tf_static", TFMessage, queue_size=100, latch=True)
        self._kept |= {each.child_frame_id: each for each in transforms}
        await self._static.publish(TFMessage(list(self._kept.values())))

    async def close(self) -> None:
        """Stop publishing. Idempotent."""
        publishers, self.moving, self._static = (self.moving, self._static), None, None
        for publisher in publishers:
            if publisher is not None:
                await publisher.close()


async def _first_of(changed: asyncio.Event, end: asyncio.Future[None]) -> None:
    """Wait until the event is set or the future is done."""
    arrival = asyncio.ensure_future(changed.wait())
    waits: list[asyncio.Future[Literal[True]] | asyncio.Future[None]] = [arrival, end]
    try:
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
    finally:
        arrival.cancel()


async def _quietly(pause: Coroutine[object, object, None]) -> None:
    """Await ``pause``; return early, without an error, if the node shuts down or its time jumps."""
    with contextlib.suppress(ROSInterruptException):
        await pause
