"""ActionClient for asyncio programs, and the goals that it sends."""

from __future__ import annotations

import asyncio
import itertools
from collections import deque
from collections.abc import AsyncIterator, Callable, Generator
from typing import Generic, TypeVar, cast

from actionlib_msgs.msg import GoalID, GoalStatus

from minirospy import Node
from minirospy.aio import Publisher, Subscription
from minirospy.base.errors import DeserializationError, ROSException, ROSInterruptException
from minirospy.core.graph.goals import TERMINAL, GoalState
from minirospy.core.idl.protocols import ActionFeedback, ActionGoal, ActionResult, Message
from minirospy.core.idl.protocols import GoalStatus as AnyGoalStatus
from minirospy.ros.actionlib.actionlib.aio.common import WAITING, ActionClass, ActionEnd, GoalError
from minirospy.ros.actionlib.actionlib.spec import SERVER_SECONDS, TAKES_FAST_ANSWERS
from minirospy.ros.actionlib.actionlib.statuses import StatusList, find_status

__all__ = ["ActionClient", "ClientGoal"]

_G = TypeVar("_G")
_R = TypeVar("_R")
_F = TypeVar("_F")
_M = TypeVar("_M", bound=Message)


class ClientGoal(Generic[_R, _F]):
    """A goal sent with :meth:`ActionClient.send`.

    ``async for`` over the goal yields feedback until the goal reaches a terminal state. ``await goal`` returns the result, or
    raises GoalError if the goal was not reached, or ROSInterruptException if the client or node was closed before that.
    ``async with goal:`` cancels the goal if the block is left before the goal has ended.
    """

    def __init__(self, id: str, cancel: Callable[[ClientGoal[_R, _F]], None]) -> None:
        self.id = id
        self.state = GoalState.PENDING  # the last status that the server published
        self.text = ""  # the text that the server sent with the status
        self._cancel = cancel
        self._feedback: deque[_F] = deque(maxlen=WAITING)
        self._news = asyncio.Event()
        self._is_sent = False
        self._is_known = False
        self._ended: asyncio.Future[_R | None] = asyncio.get_running_loop().create_future()

    @property
    def done(self) -> bool:
        """Return whether the goal has reached a terminal state."""
        return self._ended.done()

    def cancel(self) -> None:
        """Send the server a cancel request; the server decides the goal's final state. Do nothing if the goal is done."""
        if not self.done:
            self._cancel(self)

    def __await__(self) -> Generator[object, None, _R]:
        return self._result().__await__()

    def __aiter__(self) -> AsyncIterator[_F]:
        return self

    async def __anext__(self) -> _F:
        while not self._feedback:
            if self.done:
                raise StopAsyncIteration
            self._news.clear()
            await self._news.wait()
        return self._feedback.popleft()

    async def __aenter__(self) -> ClientGoal[_R, _F]:
        return self

    async def __aexit__(self, *_: object) -> None:
        self.cancel()

    async def _result(self) -> _R:
        result = await asyncio.shield(self._ended)
        if self.state is not GoalState.SUCCEEDED:
            raise GoalError(self.text, result, self.state)
        assert result is not None
        return result

    def _take_feedback(self, feedback: _F) -> None:
        self._feedback.append(feedback)
        self._news.set()

    def _take_status(self, status: GoalStatus | None) -> None:
        """Process the goal's entry in the server's status list; ``status`` is None if the list does not contain the goal."""
        if status is not None:
            self._is_known = True
            self.state, self.text = GoalState(status.status), status.text
        elif self._is_known and self.state not in TERMINAL:
            # The server listed the goal before and no longer does, so it must have restarted.
            self._end(GoalState.LOST, "the server does not know the goal any more", None)

    def _end(self, state: GoalState, text: str, result: _R | None) -> None:
        if not self.done:
            self.state, self.text = state, text
            self._ended.set_result(result)
            self._news.set()

    def _interrupt(self) -> None:
        if not self.done:
            self._ended.set_exception(ROSInterruptException("rospy shutdown"))
            # Mark the exception as retrieved; otherwise asyncio logs it when no caller has awaited the goal.
            self._ended.exception()
            self._news.set()


class ActionClient(ActionEnd, Generic[_G, _R, _F]):
    """A client for the action ``name``; ``action`` is the action's class, such as ``runningLedAction``.

    Use it with ``async with``, or call ``await client.close()`` when done. Raise ActionException if ``action`` is not an
    action class.
    """

    _numbers = itertools.count(1)

    def __init__(self, node: Node, name: str, action: type[ActionClass[_G, _R, _F]]) -> None:
        super().__init__(node, name, action)
        types = self._types
        self._goals: dict[str, ClientGoal[_R, _F]] = {}
        self._goal: Publisher[ActionGoal] = node.advertise(
            self._topic("goal"), types.action_goal, tcp_nodelay=True, headers=TAKES_FAST_ANSWERS
        )
        self._cancel: Publisher[GoalID] = node.advertise(self._topic("cancel"), GoalID, tcp_nodelay=True)
        self._status = node.subscribe(self._topic("status"), StatusList, queue_size=WAITING)
        self._result = node.subscribe(self._topic("result"), types.action_result, queue_size=WAITING)
        self._feedback = node.subscribe(self._topic("feedback"), types.action_feedback, queue_size=WAITING)
        self._statuses: StatusList | None = None  # the last status list received
        self._status._state.subscription.on_ended.append(self._status_link_ended)
        self._heard = asyncio.Event()
        self._start(self._read(self._status, self._take_status))
        self._start(self._read(self._result, self._take_result))
        self._start(self._read(self._feedback, self._take_feedback))
        self._registration = asyncio.ensure_future(self._register())

    async def wait_for_server(self, timeout: float | None = None) -> None:
        """Wait until a server is connected on all five topics. Raise TimeoutError after ``timeout`` seconds."""
        try:
            await asyncio.wait_for(self._wait_for_server(), timeout)
        except asyncio.TimeoutError:
            raise TimeoutError(f"timeout exceeded while waiting for the action server {self.name}") from None

    def send(self, goal: _G) -> ClientGoal[_R, _F]:
        """Send a goal as soon as a server is connected, and return the goal. Raise ROSException if the client is closed."""
        if self._is_closed or self._node.is_shutdown:
            raise ROSException(f"send() of a closed action client of {self.name}")
        now = self._node.now()
        id = f"{self._node.name}-{next(self._numbers)}-{now.secs}.{now.nsecs}"
        message = self._types.action_goal(goal_id=GoalID(stamp=now, id=id), goal=goal)
        message.header.stamp = now
        sent: ClientGoal[_R, _F] = ClientGoal(id, self._cancel_goal)
        self._goals[id] = sent
        self._start(self._send(message, sent))
        return sent

    def cancel_all(self) -> None:
        """Send the server a request to cancel all its goals, including those from other clients."""
        self._start(self._cancel.publish(GoalID()))

    async def close(self) -> None:
        """Unregister from the action's topics.

        Running goals continue on the server, but this client no longer receives their feedback or results. Idempotent.
        """
        self._is_closed = True
        hooks = self._status._state.subscription.on_ended
        if self._status_link_ended in hooks:
            hooks.remove(self._status_link_ended)
        for goal in list(self._goals.values()):
            goal._interrupt()
        self._goals.clear()
        await self._end_tasks()
        for end in (self._goal, self._cancel, self._status, self._result, self._feedback):
            await end.close()

    async def _register(self) -> None:
        for end in (self._goal, self._cancel, self._status, self._result, self._feedback):
            await end

    async def _wait_for_server(self) -> None:
        await self
        await self._heard.wait()
        for publisher in (self._goal, self._cancel):
            await publisher.wait_for_subscribers()
        for subscription in (self._result, self._feedback):
            await subscription.wait_for_publishers()

    async def _send(self, message: ActionGoal, goal: ClientGoal[_R, _F]) -> None:
        await self._wait_for_server()
        if not goal.done:
            goal._is_sent = True
            await self._goal.publish(message)

    def _cancel_goal(self, goal: ClientGoal[_R, _F]) -> None:
        if not self._is_closed:
            self._start(self._send_cancel(goal))

    async def _send_cancel(self, goal: ClientGoal[_R, _F]) -> None:
        # A connection does not prove that there is a server: `rostopic echo` also connects to the goal topic.
        if goal._is_sent and self._goal.num_connections:
            await self._cancel.publish(GoalID(id=goal.id))
        else:
            self._end_goal(goal, GoalState.RECALLED, "cancelled before a server was there", None)

    async def _read(self, subscription: Subscription[_M], take: Callable[[_M], None]) -> None:
        async for message in subscription:
            try:
                take(message)
            except DeserializationError as error:  # a StatusList is parsed on first access, which may fail
                self._node.log.error("a message on %s is ignored: %s", subscription.topic, error)
        for goal in list(self._goals.values()):
            goal._interrupt()

    def _take_status(self, statuses: StatusList) -> None:
        self._heard.set()
        self._statuses = statuses
        for goal in list(self._goals.values()):
            status = find_status(statuses, goal.id)
            if status is None or self._is_valid(status):
                goal._take_status(status)
            if goal.done:
                del self._goals[goal.id]

    def _is_valid(self, status: AnyGoalStatus) -> bool:
        """Return whether ``status`` is one of the known statuses; log an error otherwise."""
        try:
            GoalState(status.status)
        except ValueError:
            self._node.log.error("Got an unknown status from the ActionServer: %i", status.status)
            return False
        return True

    def _status_link_ended(self) -> None:
        """Check whether the server is gone, SERVER_SECONDS after a status connection has ended."""
        if goals := [goal for goal in self._goals.values() if goal._is_sent]:
            self._check_later(goals)

    def _check_later(self, goals: list[ClientGoal[_R, _F]]) -> None:
        asyncio.get_running_loop().call_later(SERVER_SECONDS, self._check_server, goals, self._statuses)

    def _check_server(self, goals: list[ClientGoal[_R, _F]], last: StatusList | None) -> None:
        """Mark ``goals`` missing from a status list newer than ``last`` as LOST, or all if no server is connected."""
        if self._is_closed or self._node.is_shutdown:
            return
        statuses, is_connected = self._statuses, self._status.num_connections > 0
        if is_connected and statuses is last:
            self._check_later(goals)
            return
        for goal in goals:
            is_listed = is_connected and statuses is not None and find_status(statuses, goal.id) is not None
            if not goal.done and not is_listed:
                self._node.log.error(
                    "The action server [%s] has died or is unreachable: goal %s is LOST", self.name, goal.id
                )
                self._end_goal(goal, GoalState.LOST, "the server has died or is unreachable", None)

    def _take_result(self, message: ActionResult) -> None:
        status = message.status
        goal = self._goals.get(status.goal_id.id)
        if goal is not None and self._is_valid(status):
            # Feedback uses a separate connection: first process the feedback that has already arrived.
            end = (goal, GoalState(status.status), status.text, cast("_R", message.result))
            asyncio.get_running_loop().call_soon(self._end_goal, *end)

    def _take_feedback(self, message: ActionFeedback) -> None:
        goal = self._goals.get(message.status.goal_id.id)
        if goal is not None:
            goal._take_feedback(cast("_F", message.feedback))

    def _end_goal(self, goal: ClientGoal[_R, _F], state: GoalState, text: str, result: _R | None) -> None:
        self._goals.pop(goal.id, None)
        goal._end(state, text, result)
