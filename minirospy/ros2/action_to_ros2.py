"""Offers a ROS 2 action in ROS 1: sends goals to ROS 2, and feedback and results to ROS 1."""

from __future__ import annotations

import asyncio
import contextlib
from concurrent.futures import Future
from typing import TYPE_CHECKING, TypeVar

from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.base.errors import BridgeError, DeserializationError, ROSException
from minirospy.core.graph.goals import SERVER_STEPS, TERMINAL, GoalEvent, GoalState, is_meant
from minirospy.core.idl.cdr import CDR_HEADER
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.ros2.action_messages import (
    GoalId,
    Status,
    parse_cancel,
    parse_goal,
    status_and_body,
    statuses_message,
)
from minirospy.ros2.rclpy_actions import CANCELED, SUCCEEDED
from minirospy.ros2.reach import Reach
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.aio.topics import Publisher
    from minirospy.core.idl.protocols import Message
    from minirospy.ros2.action_codecs import ActionCodec
    from minirospy.ros2.action_links import ActionLink
    from minirospy.ros2.interface import Ros2Goal, Ros2Side

__all__ = ["MAX_GOALS", "GoalsToRos2"]

_T = TypeVar("_T")
_STATUS_SECONDS = 0.2
_KEPT_SECONDS = 5.0
_LOOK_SECONDS = 0.5
_ABSENT_LOOKS = 3
REACH_SECONDS = 2.0
"""Maximum seconds to wait for the server when this link is opened, which delays the opening of other links."""
ACCEPT_SECONDS = 10.0
_ACK_SECONDS = 1e-3
"""Seconds to delay a response: Python's actionlib drops a response that arrives before its send_goal() has returned."""
_QUEUE = 50
_MAX_SENT = 4
"""Maximum number of sent goals that are not accepted yet. A server queues only 10, and further goals would be lost."""
MAX_GOALS = 1_000
"""Maximum number of stored goals, including those that ended recently; further goals are rejected."""
_EVENTS = {SUCCEEDED: GoalEvent.SUCCEED, CANCELED: GoalEvent.CANCEL}


class _Goal:
    """A goal from a ROS 1 client."""

    def __init__(self, id: GoalId) -> None:
        self.status = Status(id, int(GoalState.PENDING))
        self.there: Ros2Goal | None = None
        self.is_cancelled = False
        self.ended_at = 0.0

    def step(self, event: GoalEvent, text: str = "") -> None:
        """Apply an event to the goal's state; ignore events that the state does not allow."""
        state = SERVER_STEPS[event].get(self.status.state)
        if state is not None:
            self.status = Status(self.status.goal, int(state), text)

    def fail(self, text: str) -> None:
        """Abort the goal, or reject it if it has not been accepted yet. ``text`` is the reason."""
        self.step(GoalEvent.REJECT if self.there is None else GoalEvent.ABORT, text)


class GoalsToRos2:
    """Forwards goals from ROS 1 clients to a ROS 2 action server. Runs on the node's loop."""

    def __init__(self, node: Node, side: Ros2Side, link: ActionLink, codec: ActionCodec) -> None:
        self._node = node
        self._link = link
        self._codec = codec
        self._client = side.action_client(link.action, link.ros2_type)
        self._misfits = RateLimitedLogger(node.log)
        self._loop = asyncio.get_running_loop()
        self._goals: dict[str, _Goal] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._number = 0
        self._turns = asyncio.Semaphore(_MAX_SENT)
        self._changed = asyncio.Event()
        self._ended = asyncio.Event()

        def publisher(name: str, *, latch: bool = False) -> Publisher[Message]:
            return node.advertise(
                f"{link.action}/{name}", codec.classes[name], queue_size=_QUEUE, latch=latch, tcp_nodelay=True
            )

        self._status = publisher("status", latch=True)
        self._result = publisher("result")
        self._feedback = publisher("feedback")
        self._subscriptions = [
            node.subscribe_raw(f"{link.action}/goal", self._take_goal),
            node.subscribe_raw(f"{link.action}/cancel", self._take_cancel),
        ]
        self._reporter = ErrorReporter(node.log, f"action {link.action}")
        self._telling = asyncio.ensure_future(keep_running(self._publish_statuses, self._reporter))
        self._reach = Reach(self._client)

    async def open(self) -> None:
        """Wait for the ROS 2 server, then register the action's topics with the ROS 1 master."""
        self._reach.start()
        await self._reach.wait(REACH_SECONDS)
        for end in (self._status, self._result, self._feedback, *self._subscriptions):
            await end

    async def close(self) -> None:
        """Close the action, and abort its running goals."""
        self._ended.set()
        await self._reach.close()
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=1.0)
        for task in (*self._tasks, self._telling):
            task.cancel()
        await asyncio.gather(*self._tasks, self._telling, return_exceptions=True)
        for end in (*self._subscriptions, self._status, self._result, self._feedback):
            await end.close()
        self._client.close()

    def _take_goal(self, frame: Frame, _: Header) -> None:
        try:
            id, body = parse_goal(frame)
            request = self._codec.goal.to_cdr(body, CDR_HEADER)
        except DeserializationError as error:
            self._misfits.error("a goal of action %s: %s", self._link.action, error)
            return
        secs, nsecs = self._now()
        if not id.nanoseconds:
            id = GoalId(id.id, secs, nsecs)
        if not id.id:
            self._number += 1
            id = GoalId(f"{self._node.name}-{self._number}-{secs}.{nsecs}", id.secs, id.nsecs)
        if id.id in self._goals or self._ended.is_set():
            return
        if len(self._goals) >= MAX_GOALS:
            self._refuse(id)
            return
        goal = self._goals[id.id] = _Goal(id)
        task = asyncio.ensure_future(self._run(goal, request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _refuse(self, id: GoalId) -> None:
        text = f"the bridge passes on {MAX_GOALS} goals of action {self._link.action} already"
        self._misfits.error("a goal is refused: %s", text)
        status = Status(id, int(GoalState.REJECTED), text)
        with contextlib.suppress(ROSException):
            self._result.publish_raw(status_and_body(*self._now(), status, self._codec.empty_result))

    def _take_cancel(self, frame: Frame, _: Header) -> None:
        try:
            cancel = parse_cancel(frame)
        except DeserializationError as error:
            self._misfits.error("a cancel of action %s: %s", self._link.action, error)
            return
        for goal in self._goals.values():
            id = goal.status.goal
            if not goal.ended_at and is_meant(cancel.id, cancel.nanoseconds, id.id, id.nanoseconds):
                goal.is_cancelled = True
                goal.step(GoalEvent.CANCEL_REQUEST)
                if goal.there:
                    goal.there.cancel()
        self._changed.set()

    async def _run(self, goal: _Goal, request: bytes) -> None:
        """Send a goal to ROS 2, and return its result to ROS 1."""
        body = self._codec.empty_result
        self._changed.set()
        try:
            await asyncio.sleep(_ACK_SECONDS)
            await self._become_ready()
            await self._reach.wait()
            async with self._turns:
                sending = self._client.send(request, lambda data: self._pass_feedback(goal, data))
                goal.there = await asyncio.wait_for(self._watched(sending), ACCEPT_SECONDS)
            if goal.there is None:
                goal.step(GoalEvent.REJECT, "the server in ROS 2 refuses this goal")
            else:
                goal.step(GoalEvent.ACCEPT)
                self._changed.set()
                if goal.is_cancelled:
                    goal.there.cancel()
                status, data = await self._watched(goal.there.result())
                body = self._codec.result.to_ros1(data)
                goal.step(_EVENTS.get(status, GoalEvent.ABORT))
        except asyncio.TimeoutError:
            goal.step(GoalEvent.REJECT, f"the server in ROS 2 has not answered within {ACCEPT_SECONDS:g} s")
        except (BridgeError, DeserializationError) as error:
            goal.fail(" ".join(str(error).split()))
        except Exception as error:  # noqa: BLE001 - the client needs a result, even after an error
            self._reporter.report(error)
            goal.fail(f"the bridge failed: {type(error).__name__}")

        goal.ended_at = self._loop.time()
        self._changed.set()
        with contextlib.suppress(ROSException):
            self._result.publish_raw(status_and_body(*self._now(), goal.status, body))

    async def _become_ready(self) -> None:
        """Wait briefly for the server, because a newly discovered action may not be connected yet."""
        end = self._loop.time() + _ABSENT_LOOKS * _LOOK_SECONDS
        while not self._client.is_ready and self._loop.time() < end and not self._ended.is_set():
            await asyncio.sleep(0.02)

    async def _watched(self, future: Future[_T]) -> _T:
        """Return the result of a future. Raise BridgeError if the server disappears first."""
        answered = asyncio.wrap_future(future)
        ended: asyncio.Future[bool] = asyncio.ensure_future(self._ended.wait())
        awaited: list[asyncio.Future[_T] | asyncio.Future[bool]] = [answered, ended]
        absent = 0
        try:
            while not answered.done():
                await asyncio.wait(awaited, timeout=_LOOK_SECONDS, return_when=asyncio.FIRST_COMPLETED)
                absent = 0 if self._client.is_ready else absent + 1
                if not answered.done() and (ended.done() or absent >= _ABSENT_LOOKS):
                    raise BridgeError(f"the server of action [{self._link.action}] in ROS 2 has ended")
        finally:
            answered.cancel()
            ended.cancel()
        return answered.result()

    def _pass_feedback(self, goal: _Goal, data: bytes) -> None:
        """Send feedback to ROS 1. Runs in the executor's thread, which writes to the ROS 1 sockets directly."""
        try:
            body = self._codec.feedback.to_ros1(data)
            if goal.status.state not in TERMINAL:
                self._feedback.publish_raw(status_and_body(*self._now(), goal.status, body))
        except DeserializationError as error:
            self._misfits.error("feedback of action %s: %s", self._link.action, error)
        except ROSException:
            return  # the action was closed in the meantime

    async def _publish_statuses(self) -> None:
        """Publish the statuses of all goals after each change, and at regular intervals."""
        await self._status
        # Check the flag, because wait_for may swallow a cancellation in Python 3.11.
        while not self._ended.is_set():
            self._changed.clear()
            limit = self._loop.time() - _KEPT_SECONDS
            for id in [id for id, goal in self._goals.items() if 0 < goal.ended_at < limit]:
                del self._goals[id]
            statuses = [goal.status for goal in self._goals.values()]
            with contextlib.suppress(ROSException):
                self._status.publish_raw(statuses_message(*self._now(), statuses))
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._changed.wait(), _STATUS_SECONDS)

    def _now(self) -> tuple[int, int]:
        now = self._node.now()
        return now.secs, now.nsecs
