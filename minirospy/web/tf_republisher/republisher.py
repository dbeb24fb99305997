"""The action /tf2_web_republisher and the service /republish_tfs. Source: http://wiki.ros.org/tf2_web_republisher."""

from __future__ import annotations

import asyncio
import itertools
from typing import Protocol

from geometry_msgs.msg import TransformStamped
from tf2_web_republisher.msg import (
    TFArray,
    TFSubscriptionAction,
    TFSubscriptionFeedback,
    TFSubscriptionGoal,
    TFSubscriptionResult,
)
from tf2_web_republisher.srv import RepublishTFs, RepublishTFsRequest

from minirospy.aio.node import Node
from minirospy.aio.tasks import ErrorReporter
from minirospy.aio.topics import Publisher
from minirospy.base.errors import BridgeError, ServiceException, TransformException
from minirospy.ros.actionlib.actionlib.aio import ActionServer, GoalError, ServerGoal
from minirospy.ros.tf2_ros.tf2_ros.aio import Buffer
from minirospy.web.tf_republisher.pairs import FramePair, pairs_of

__all__ = ["NAME", "Republisher"]

NAME = "/tf2_web_republisher"

_DEFAULT_RATE = 10.0
_MAX_RATE = 1000.0
_MAX_REQUESTS = 1000
_A_TURN = 50
"""Number of frames to look up before other tasks may run."""


class _Closing(Protocol):
    """A part of the republisher, to be closed when the republisher is closed."""

    async def close(self) -> None: ...


class Republisher:
    """Looks up transforms for its clients. Runs on the node's loop."""

    def __init__(self, node: Node, name: str = NAME) -> None:
        """Create the republisher. ``name`` is the action's name, and the namespace of the topics created for requests."""
        self.node = node
        self._name = name
        self._buffer = Buffer(node)
        self._ids = itertools.count()
        self._closing: list[_Closing] = []
        self._requests: set[asyncio.Task[None]] = set()
        self._reporter = ErrorReporter(node.log, "republishing transforms")

    async def start(self) -> None:
        """Subscribe to the transforms, and offer the action and the service."""
        await self._buffer.start()
        server = ActionServer(self.node, self._name, TFSubscriptionAction, self._execute, concurrent=True)
        self._closing.append(server)
        self._closing.append(await self.node.serve("/republish_tfs", RepublishTFs, self._republish))
        await server

    async def close(self) -> None:
        """Close all parts, and cancel all requests. Idempotent."""
        closing, self._closing = self._closing, []
        for part in closing:
            await part.close()
        for task in list(self._requests):
            task.cancel()
        await asyncio.gather(*self._requests, return_exceptions=True)
        await self._buffer.close()

    async def _execute(
        self, goal: ServerGoal[TFSubscriptionGoal, TFSubscriptionFeedback]
    ) -> TFSubscriptionResult:
        """Send transforms as feedback until the client cancels the goal."""
        try:
            pairs, period = pairs_of(goal.request), _period(goal.request.rate)
        except BridgeError as error:
            raise GoalError(str(error)) from error
        while True:
            transforms = await self._changed(pairs)
            if transforms:
                await goal.publish_feedback(transforms=transforms)
            await self.node.sleep(period)

    async def _republish(self, request: RepublishTFsRequest) -> object:
        """Publish transforms on a separate topic until it has had no subscribers for the duration ``timeout``."""
        if len(self._requests) >= _MAX_REQUESTS:
            raise ServiceException(f"{_MAX_REQUESTS} requests are served: no more")
        try:
            pairs = pairs_of(request)
        except BridgeError as error:
            raise ServiceException(str(error)) from error
        topic = f"{self._name}/tf_repub_{next(self._ids)}"
        publisher = self.node.advertise(topic, TFArray, queue_size=10, latch=True)
        task = asyncio.ensure_future(self._serve(request, pairs, publisher))
        self._requests.add(task)
        task.add_done_callback(self._requests.discard)
        task.add_done_callback(self._reporter.of_task)
        # A rosbridge client subscribes without a type, so the master must know the topic before the response is sent.
        await publisher
        self.node.log.info("Publishing requested TFs on topic %s", topic)
        return {"topic_name": topic}

    async def _serve(
        self, request: RepublishTFsRequest, pairs: list[FramePair], publisher: Publisher[TFArray]
    ) -> None:
        period = _period(request.rate)
        timeout = request.timeout.to_sec()
        loop = asyncio.get_running_loop()
        async with publisher:
            wanted = loop.time()
            while True:
                if publisher.num_connections:
                    wanted = loop.time()
                elif loop.time() - wanted > timeout:
                    self.node.log.info(
                        "No subscribers on tf topic for %g seconds. Unadvertising topic:%s",
                        timeout,
                        publisher.topic,
                    )
                    return
                transforms = await self._changed(pairs)
                if transforms:
                    await publisher.publish(transforms=transforms)
                await self.node.sleep(period)

    async def _changed(self, pairs: list[FramePair]) -> list[TransformStamped]:
        """Return the transforms that have changed enough to be sent."""
        found = []
        for number, pair in enumerate(pairs, 1):
            if not number % _A_TURN:
                await asyncio.sleep(0)
            try:
                transform = await self._buffer.lookup(pair.target, pair.source)
            except TransformException as error:
                if pair.is_okay:
                    self.node.log.error("%s", error)
                pair.is_okay = False
                continue
            if not pair.is_okay:
                self.node.log.info("Transform from %s to %s is working again", pair.source, pair.target)
            pair.is_okay = True
            if pair.is_to_be_sent(transform.transform):
                transform.header.stamp = self.node.now()
                found.append(transform)
        return found


def _period(rate: float) -> float:
    return 1 / min(rate, _MAX_RATE) if rate > 0 else 1 / _DEFAULT_RATE
