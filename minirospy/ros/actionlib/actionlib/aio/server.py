"""ActionServer for asyncio programs, and the goals that it receives."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Mapping, Sequence
from io import BytesIO
from typing import Any, Generic, TypeVar, cast

from actionlib_msgs.msg import GoalID, GoalStatus

from minirospy import Node
from minirospy.aio import Publisher, Subscription
from minirospy.base.errors import ROSException
from minirospy.core.graph.goals import SERVER_STEPS, GoalEvent, GoalState, is_meant
from minirospy.core.idl.protocols import ActionFeedback, ActionGoal, ActionResult, Message
from minirospy.core.idl.service import to_response
from minirospy.ros.actionlib.actionlib.aio.common import WAITING, ActionClass, ActionEnd, GoalError
from minirospy.ros.actionlib.actionlib.spec import CANCEL_SECONDS, SEND_SECONDS, TAKES_FAST_ANSWERS
from minirospy.ros.actionlib.actionlib.statuses import StatusList, status_bytes

__all__ = ["ActionServer", "ServerGoal"]

_G = TypeVar("_G")
_R = TypeVar("_R")
_F = TypeVar("_F")

# seconds to pause after publishing a status list, per goal in the list, so that publishing does not use all CPU time
_SECONDS_A_STATUS = 1e-4

_EVENTS = {
    GoalState.PREEMPTED: GoalEvent.CANCEL,
    GoalState.RECALLED: GoalEvent.CANCEL,
    GoalState.SUCCEEDED: GoalEvent.SUCCEED,
}


class ServerGoal(Generic[_G, _F]):
    """A goal received by a server; the argument of ``execute``."""

    def __init__(self, server: ActionServer[_G, Any, _F], message: ActionGoal) -> None:
        self.request = cast("_G", message.goal)  # the goal message
        self.is_cancel_requested = False  # set when a client cancels the goal, or a newer goal preempts it
        self.text = ""  # the text sent with the goal's final status
        self._server = server
        self._status = GoalStatus(goal_id=cast("GoalID", message.goal_id))
        self._task: asyncio.Task[None] | None = None
        self._has_begun = False
        self._ended_at = 0

    @property
    def id(self) -> str:
        """Return the goal's ID."""
        return self._status.goal_id.id

    @property
    def state(self) -> GoalState:
        """Return the status of the goal."""
        return GoalState(self._status.status)

    async def publish_feedback(self, *args: object, **kwds: object) -> None:
        """Send feedback to the goal's client: pass the feedback message, or its fields."""
        await self._server._publish_feedback(self, args, kwds)

    def _step(self, event: GoalEvent, text: str = "") -> None:
        state = SERVER_STEPS[event].get(self._status.status)
        if state is not None:
            self._status.status, self._status.text = int(state), text

    def _make_way(self) -> None:
        """Cancel the goal's task. Called when a client cancels the goal or a newer goal preempts it.

        Repeated calls have no effect.
        """
        if self._task and not self.is_cancel_requested:
            self.is_cancel_requested = True
            # A task that is cancelled before it starts never runs, and the client would get no result.
            if self._has_begun:
                self._task.cancel()


Execute = Callable[[ServerGoal[_G, _F]], Awaitable[object]]


class ActionServer(ActionEnd, Generic[_G, _R, _F]):
    """A server for the action ``name``; it runs ``await execute(goal)`` for each goal.

    If ``execute`` returns, the goal has succeeded, and the return value is its result: a result message, a dictionary of
    fields, all values, the value of the only field, or None for an empty result. GoalError aborts the goal, with a status
    text and a result; any other exception also aborts the goal, and is logged.
    If a client cancels the goal, ``execute`` is cancelled: CancelledError is raised at its current ``await``. The goal is
    then preempted, with the result that ``execute`` may still return.

    One goal runs at a time, and a newer one preempts it, as in SimpleActionServer; if ``concurrent``, goals run
    concurrently. ``accepts(goal)`` may reject a goal by returning False.

    Use it with ``async with``, or call ``await server.close()`` when done. Raise ActionException if ``action`` is not an
    action class.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        action: type[ActionClass[_G, _R, _F]],
        execute: Execute[_G, _F],
        *,
        accepts: Callable[[_G], bool] | None = None,
        concurrent: bool = False,
    ) -> None:
        super().__init__(node, name, action)
        types = self._types
        self._execute = execute
        self._accepts = accepts
        self._concurrent = concurrent
        self.goals: dict[str, ServerGoal[_G, _F]] = {}
        self._canceled_early: dict[str, int] = {}
        self._last_cancel = 0
        self._kept_nanoseconds = 0
        self._changed = asyncio.Event()

        self._result: Publisher[ActionResult] = node.advertise(
            self._topic("result"), types.action_result, queue_size=50, tcp_nodelay=True
        )
        self._feedback: Publisher[ActionFeedback] = node.advertise(
            self._topic("feedback"), types.action_feedback, queue_size=50, tcp_nodelay=True
        )
        self._status: Publisher[StatusList] = node.advertise(
            self._topic("status"), StatusList, queue_size=50, tcp_nodelay=True, latch=True
        )

        self._subscriptions: list[Subscription[Message]] = []
        self._registration = self._start(self._register())

    async def close(self) -> None:
        """Unregister from the action's topics and abort running goals. Idempotent."""
        self._is_closed = True
        await self._end_tasks()
        for end in (*self._subscriptions, self._result, self._feedback, self._status):
            await end.close()

    async def _register(self) -> None:
        node = self._node
        found = await node.search_param("actionlib_status_frequency")
        frequency = await node.get_param(found, 5.0) if found else 5.0
        if not isinstance(frequency, int | float) or frequency <= 0:
            raise ROSException(f"parameter {found} must be a number of Hz above 0, not {frequency!r}")
        seconds = await node.get_param(f"{self.name}/status_list_timeout", 5.0)
        self._kept_nanoseconds = int(seconds * 1e9)
        for publisher in (self._result, self._feedback, self._status):
            await publisher
        for topic, message_class, take in (
            ("goal", self._types.action_goal, self._take_goal),
            ("cancel", GoalID, self.take_cancel),
        ):
            subscription = node.subscribe(self._topic(topic), message_class, queue_size=WAITING)
            self._subscriptions.append(subscription)
            self._start(self._read(subscription, take))
            await subscription
        self._start(self._publish_regularly(1.0 / frequency))

    async def _read(
        self, subscription: Subscription[Message], take: Callable[[Any], Awaitable[None]]
    ) -> None:
        async for message in subscription:
            await take(message)
        # The node is shutting down, so stop the running goals.
        for goal in self._running():
            if goal._task:
                goal._task.cancel()

    async def _take_goal(self, message: ActionGoal) -> None:
        if not TAKES_FAST_ANSWERS.items() <= (message._connection_header or {}).items():
            await asyncio.sleep(SEND_SECONDS)
        now = self._node.now()
        if not message.goal_id.id:
            message.goal_id.id = f"{self._node.name}-{len(self.goals)}-{now.secs}.{now.nsecs}"
        if not message.goal_id.stamp:
            message.goal_id.stamp = now
        goal = ServerGoal(self, message)
        if goal.id in self.goals:
            return
        self.goals[goal.id] = goal
        stamp = message.goal_id.stamp.to_nsec()
        others = [] if self._concurrent else self._running(but=goal)

        if self._canceled_early.pop(goal.id, 0) or stamp <= self._last_cancel:
            goal.text = "it was cancelled before it came"
            await self._finish(goal, GoalEvent.CANCEL)
        elif not self._is_accepted(goal):
            await self._finish(goal, GoalEvent.REJECT)
        elif any(stamp < other._status.goal_id.stamp.to_nsec() for other in others):
            goal.text = "a newer goal is there"
            await self._finish(goal, GoalEvent.CANCEL)
        else:
            for other in others:
                other._make_way()
            before = [other._task for other in others if other._task]
            goal._task = self._start(self._run(goal, before))
            self._changed.set()

    def _is_accepted(self, goal: ServerGoal[_G, _F]) -> bool:
        try:
            if self._accepts is None or self._accepts(goal.request):
                return True
            goal.text = "the server does not accept this goal"
        except Exception as error:
            goal.text = f"Exception in accepts callback: {error}"
            self._node.log.exception("Exception in your accepts callback: %s", error)
        return False

    async def take_cancel(self, cancel: GoalID) -> None:
        await asyncio.sleep(CANCEL_SECONDS)
        stamp = cancel.stamp.to_nsec()
        for goal in self._running():
            if is_meant(cancel.id, stamp, goal.id, goal._status.goal_id.stamp.to_nsec()):
                goal._step(GoalEvent.CANCEL_REQUEST)
                goal._make_way()
        if cancel.id and cancel.id not in self.goals:
            # A goal may arrive after the request to cancel it, so store the request.
            self._canceled_early[cancel.id] = self._node.now().to_nsec()
        self._last_cancel = max(self._last_cancel, stamp)
        self._changed.set()

    async def _run(self, goal: ServerGoal[_G, _F], before: list[asyncio.Task[None]]) -> None:
        """Execute a goal once the goals that it preempts have finished."""
        event, result, returned = GoalEvent.SUCCEED, None, None
        goal._has_begun = True

        try:
            if goal.is_cancel_requested:
                raise asyncio.CancelledError
            if before:
                await asyncio.wait(before)
            goal._step(GoalEvent.ACCEPT)
            self._changed.set()
            returned = await self._execute(goal)
        except asyncio.CancelledError:
            if not goal.is_cancel_requested:
                event, goal.text = GoalEvent.ABORT, goal.text or "the server ends"
        except GoalError as error:
            event, returned, goal.text = _EVENTS.get(error.state, GoalEvent.ABORT), error.result, error.text
        except Exception as error:
            event, goal.text = GoalEvent.ABORT, f"Exception in execute callback: {error}"
            self._node.log.exception("Exception in your execute callback: %s", error)

        try:
            if returned is not None:
                result = to_response(self._types.result, returned)
                result.serialize(BytesIO())
        except Exception as error:  # noqa: BLE001 - user code may raise any exception
            event, result, goal.text = GoalEvent.ABORT, None, f"the result does not fit: {error}"
            self._node.log.error("the result of your execute callback does not fit: %s", error)

        if goal.is_cancel_requested and event is GoalEvent.SUCCEED:
            event = GoalEvent.CANCEL
        await self._finish(goal, event, result)

    async def _finish(
        self, goal: ServerGoal[_G, _F], event: GoalEvent, result: Message | None = None
    ) -> None:
        if event is GoalEvent.ABORT and goal.state in {GoalState.PENDING, GoalState.RECALLING}:
            event = GoalEvent.CANCEL
        goal._step(event, goal.text)
        now = self._node.now()
        goal._ended_at = now.to_nsec()
        message = self._types.action_result(status=goal._status, result=result or self._types.result())
        message.header.stamp = now
        self._changed.set()
        # Publishing fails during shutdown.
        with contextlib.suppress(ROSException):
            await self._result.publish(message)

    async def _publish_feedback(
        self, goal: ServerGoal[_G, _F], args: Sequence[object], kwds: Mapping[str, object]
    ) -> None:
        feedback_class = self._types.feedback
        is_whole = len(args) == 1 and not kwds and getattr(args[0], "_type", None) == feedback_class._type
        feedback = args[0] if is_whole else feedback_class(*args, **kwds)
        message = self._types.action_feedback(status=goal._status, feedback=feedback)
        message.header.stamp = self._node.now()
        await self._feedback.publish(message)

    async def _publish_regularly(self, period: float) -> None:
        """Publish the statuses of all goals, periodically and after each change."""
        while not self._node.is_shutdown:
            self._changed.clear()
            now = self._node.now()
            self._forget(now.to_nsec() - self._kept_nanoseconds)
            message = StatusList([status_bytes(goal._status) for goal in self.goals.values()])
            message.header.stamp = now
            with contextlib.suppress(ROSException):
                await self._status.publish(message)
            await asyncio.sleep(len(self.goals) * _SECONDS_A_STATUS)
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._changed.wait(), period)

    def _forget(self, limit: int) -> None:
        for id in [id for id, goal in self.goals.items() if 0 < goal._ended_at < limit]:
            del self.goals[id]
        for id in [id for id, time in self._canceled_early.items() if time < limit]:
            del self._canceled_early[id]

    def _running(self, but: ServerGoal[_G, _F] | None = None) -> list[ServerGoal[_G, _F]]:
        return [goal for goal in self.goals.values() if not goal._ended_at and goal is not but]
