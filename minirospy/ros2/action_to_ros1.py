"""Offers a ROS 1 action in ROS 2: sends goals to ROS 1, and feedback and results to ROS 2."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from typing import TYPE_CHECKING

from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import BridgeError, DeserializationError, ROSException
from minirospy.core.graph.goals import TERMINAL, GoalState
from minirospy.core.idl.cdr import CDR_HEADER
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.ros2.action_messages import (
    GoalId,
    cancel_message,
    goal_message,
    parse_status_and_body,
    parse_statuses,
)
from minirospy.ros2.rclpy_actions import ABORTED, CANCELED, SUCCEEDED
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.aio.topics import Publisher
    from minirospy.core.idl.protocols import Message
    from minirospy.ros2.action_codecs import ActionCodec
    from minirospy.ros2.action_links import ActionLink
    from minirospy.ros2.interface import GoalOfRos1, Ros2Handle, Ros2Side

__all__ = ["MAX_GOALS", "GoalsToRos1"]

SERVER_SECONDS = 5.0
"""Seconds that a ROS 1 server may take to connect, and to list a new goal in its statuses."""
MAX_GOALS = 1_000
"""Maximum number of concurrently forwarded goals; further goals are rejected."""
_PENDING_SECONDS = 0.5
"""Seconds after which a pending goal counts as accepted, because ROS 2 has no pending state."""
_ENDS = {
    GoalState.SUCCEEDED: SUCCEEDED,
    GoalState.PREEMPTED: CANCELED,
    GoalState.RECALLED: CANCELED,
}
_REFUSED = {GoalState.REJECTED, GoalState.RECALLED}


class _Goal:
    """A goal that a ROS 2 client has sent to a ROS 1 server."""

    def __init__(
        self, id: GoalId, feedback: Callable[[bytes], None], cancel: Callable[[_Goal], None]
    ) -> None:
        self.id = id
        self.feedback = feedback
        self.ended: Future[tuple[int, bytes | None]] = Future()
        self.accepted: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self.is_listed = False
        self._cancel = cancel

    def cancel(self) -> None:
        """Ask the server to cancel the goal. May be called from any thread."""
        self._cancel(self)

    def accept(self, is_accepted: bool) -> None:
        if not self.accepted.done():
            self.accepted.set_result(is_accepted)

    def end(self, status: int, result: bytes | None) -> None:
        with contextlib.suppress(InvalidStateError):
            self.ended.set_result((status, result))


class GoalsToRos1:
    """Forwards goals from ROS 2 clients to a ROS 1 action server. Runs on the node's loop."""

    def __init__(self, node: Node, side: Ros2Side, link: ActionLink, codec: ActionCodec) -> None:
        self._node = node
        self._side = side
        self._link = link
        self._codec = codec
        self._loop = asyncio.get_running_loop()
        self._misfits = RateLimitedLogger(node.log)
        self._goals: dict[str, _Goal] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._number = 0
        self._reporter = ErrorReporter(node.log, f"action {link.action}")
        self._heard = asyncio.Event()
        self._server: Ros2Handle | None = None
        self._is_closed = False

        def publisher(name: str) -> Publisher[Message]:
            return node.advertise(f"{link.action}/{name}", codec.classes[name], tcp_nodelay=True)

        self._goal = publisher("goal")
        self._cancel = publisher("cancel")
        self._subscriptions = [
            node.subscribe_raw(f"{link.action}/status", self._guarded(self._take_statuses)),
            node.subscribe_raw(f"{link.action}/feedback", self._guarded(self._take_feedback)),
            node.subscribe_raw(f"{link.action}/result", self._guarded(self._take_result)),
        ]

    async def open(self) -> None:
        """Connect to the server, then offer the action in ROS 2. Raise TypesDiffer if its types cannot be converted."""
        for end in (self._goal, self._cancel, *self._subscriptions):
            await end
        self._server = self._side.action_server(self._link.action, self._link.ros2_type, self._accept)

    async def close(self) -> None:
        """Close the action. Abort running goals, except those whose results have already arrived."""
        # Let the loop process results that have already arrived.
        await asyncio.sleep(0)
        self._is_closed = True
        for goal in list(self._goals.values()):
            self._end(goal, ABORTED, None)
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._server:
            # Wait in a thread, because close() blocks until all known results have been sent.
            await self._loop.run_in_executor(None, self._server.close)
        for end in (*self._subscriptions, self._goal, self._cancel):
            await end.close()

    def _accept(self, data: bytes, feedback: Callable[[bytes], None]) -> Future[GoalOfRos1 | None]:
        """Start a goal. Runs in the executor's thread."""
        accepted: Future[GoalOfRos1 | None] = Future()
        self._loop.call_soon_threadsafe(self._start, data, feedback, accepted)
        return accepted

    def _start(
        self, data: bytes, feedback: Callable[[bytes], None], accepted: Future[GoalOfRos1 | None]
    ) -> None:
        if self._is_closed:
            accepted.set_exception(BridgeError("it is not bridged any more"))
            return
        # Count both the running goals and those still being accepted.
        if len(self._tasks) + len(self._goals) >= MAX_GOALS:
            accepted.set_exception(BridgeError(f"the bridge passes on {MAX_GOALS} goals already"))
            return
        task = asyncio.ensure_future(self._send(data, feedback, accepted))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        # The task may be cancelled before it starts; cancel the future in that case, too.
        task.add_done_callback(lambda _: accepted.cancel())

    async def _send(
        self, data: bytes, feedback: Callable[[bytes], None], accepted: Future[GoalOfRos1 | None]
    ) -> None:
        try:
            accepted.set_result(await self._sent(data, feedback))
        except asyncio.TimeoutError:
            accepted.set_exception(BridgeError(f"its server has not answered within {SERVER_SECONDS:g} s"))
        except (DeserializationError, ROSException) as error:
            accepted.set_exception(BridgeError(str(error)))
        except Exception as error:  # noqa: BLE001 - the client needs an answer, even after an error
            self._reporter.report(error)
            accepted.set_exception(BridgeError(f"the bridge failed: {type(error).__name__}"))

    async def _sent(self, data: bytes, feedback: Callable[[bytes], None]) -> GoalOfRos1 | None:
        body = self._codec.goal.to_ros1(data)
        await asyncio.wait_for(self._connected(), SERVER_SECONDS)
        now = self._node.now()
        self._number += 1
        id = GoalId(f"{self._node.name}-{self._number}-{now.secs}.{now.nsecs}", now.secs, now.nsecs)
        goal = self._goals[id.id] = _Goal(id, feedback, self._cancel_goal)
        self._goal.publish_raw(goal_message(id, body))
        try:
            is_accepted = await asyncio.wait_for(asyncio.shield(goal.accepted), SERVER_SECONDS)
        except asyncio.TimeoutError:
            self._goals.pop(id.id, None)
            self._cancel.publish_raw(cancel_message(id))
            raise
        return goal if is_accepted else None

    async def _connected(self) -> None:
        """Wait until the server is connected in both directions; a goal sent earlier would be lost."""
        await self._heard.wait()
        for publisher in (self._goal, self._cancel):
            await publisher.wait_for_subscribers()
        while not all(subscription.headers for subscription in self._subscriptions):
            await asyncio.sleep(0.01)

    def _cancel_goal(self, goal: _Goal) -> None:
        def cancel() -> None:
            with contextlib.suppress(ROSException):
                self._cancel.publish_raw(cancel_message(GoalId(goal.id.id)))

        self._loop.call_soon_threadsafe(cancel)

    # --- messages from the ROS 1 server

    def _guarded(self, take: Callable[[Frame], None]) -> Callable[[Frame, Header], None]:
        def guarded(frame: Frame, _: Header) -> None:
            try:
                take(frame)
            except DeserializationError as error:
                self._misfits.error("a message of action %s: %s", self._link.action, error)

        return guarded

    def _take_statuses(self, frame: Frame) -> None:
        self._heard.set()
        listed = {status.goal.id: status.state for status in parse_statuses(frame)}
        for goal in list(self._goals.values()):
            state = listed.get(goal.id.id)
            if state is None:
                if goal.is_listed:
                    # The server was restarted and no longer knows the goal.
                    self._end(goal, ABORTED, None)
            elif state == GoalState.PENDING:
                if not goal.is_listed:
                    self._loop.call_later(_PENDING_SECONDS, goal.accept, True)
                goal.is_listed = True
            elif state not in _REFUSED:
                goal.is_listed = state not in TERMINAL
                goal.accept(True)

    def _take_feedback(self, frame: Frame) -> None:
        status, body = parse_status_and_body(frame)
        goal = self._goals.get(status.goal.id)
        if goal:
            goal.accept(True)
            goal.feedback(self._codec.feedback.to_cdr(body, CDR_HEADER))

    def _take_result(self, frame: Frame) -> None:
        status, body = parse_status_and_body(frame)
        goal = self._goals.get(status.goal.id)
        if not goal:
            return
        # Feedback uses another connection, so first process the feedback that has already arrived.
        self._loop.call_soon(self._take_end, goal, status.state, body)

    def _take_end(self, goal: _Goal, state: int, body: bytes) -> None:
        goal.accept(state not in _REFUSED)
        end = _ENDS.get(GoalState(state), ABORTED) if state in TERMINAL else ABORTED
        try:
            self._end(goal, end, self._codec.result.to_cdr(body, CDR_HEADER))
        except DeserializationError as error:
            self._misfits.error("a result of action %s: %s", self._link.action, error)
            self._end(goal, ABORTED, None)

    def _end(self, goal: _Goal, status: int, result: bytes | None) -> None:
        self._goals.pop(goal.id.id, None)
        goal.accept(False)
        goal.end(status, result)
