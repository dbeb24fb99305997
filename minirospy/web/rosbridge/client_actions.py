"""The goals that a rosbridge client sends to ROS 1 action servers (actionlib), as rosbridge 2 does for ROS 2.

Source: ROSBRIDGE_PROTOCOL.md in https://github.com/RobotWebTools/rosbridge_suite, branch ros2, sections 3.2.12 to 3.2.15.
"""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import BridgeError, ROSInterruptException
from minirospy.core.graph.goals import GoalState
from minirospy.core.idl.protocols import Message
from minirospy.core.wire.tcpros import ANY
from minirospy.web.json_text import dump_json_in_pieces
from minirospy.web.rosbridge import conversion, protocol
from minirospy.web.rosbridge.operation import REFUSALS, check_name, type_conflict
from minirospy.web.rosbridge.types import UnknownTypeError, message_class

if TYPE_CHECKING:
    from minirospy.ros.actionlib.actionlib.aio import ActionClient, ClientGoal
    from minirospy.web.rosbridge.operation import OperationSession

__all__ = ["ClientActions"]

_log = logging.getLogger(__name__)

_MAX_GOALS = 100  # maximum number of unfinished goals per client
_MAX_ACTIONS = 50  # maximum number of actions per client; each action has five topics
SERVER_SECONDS = 5.0  # maximum seconds to wait for an action server, as in rosbridge

_UNKNOWN = 0  # values of ROS 2's action_msgs/GoalStatus
_STATUSES = {
    GoalState.SUCCEEDED: 4,
    GoalState.PREEMPTED: 5,
    GoalState.RECALLED: 5,
    GoalState.ABORTED: 6,
}


@dataclass
class _Running:
    """A goal without a result. ``goal`` is set once the goal can be sent; ``is_cancelled`` is set on a cancel request."""

    goal: ClientGoal[Message, Message] | None = None
    is_cancelled: bool = False

    def cancel(self) -> None:
        self.is_cancelled = True
        if self.goal is not None:
            self.goal.cancel()


@dataclass
class _Action:
    """A client for an action, and the number of its goals that have no result yet."""

    client: ActionClient[Any, Message, Message]
    goals: int = 0


class ClientActions:
    """The actions used by one rosbridge client. Call the methods in the order of the client's operations."""

    def __init__(self, session: OperationSession) -> None:
        self.goals_size = 0
        """Memory used by the running goals, in bytes."""
        self._session = session
        self._actions: dict[tuple[str, Any], _Action] = {}  # keyed by (name, class)
        self._goals: dict[object, _Running] = {}  # keyed by the id of the operation
        self._count = 0  # number of unfinished goals, including those without an id
        self._reporter = ErrorReporter(_log, "a client's goal")

    def close(self) -> None:
        """Unregister the actions' topics. Unfinished goals continue."""
        for action in self._actions.values():
            self._session.graph.spawn(action.client.close())
        self._actions.clear()
        self._goals.clear()

    def send_goal(self, event: protocol.SendActionGoal) -> None:
        if not self._is_allowed(event.action):
            return
        if self._count >= _MAX_GOALS:
            raise BridgeError(f"{_MAX_GOALS} goals are running: wait for a result")
        size = self._session.operation_size
        self._count += 1
        self.goals_size += size
        running = _Running()
        if event.id is not None:
            self._goals[event.id] = running

        def ended(_: object) -> None:
            self._count -= 1
            self.goals_size -= size
            self._session.count()
            if self._goals.get(event.id) is running:
                del self._goals[event.id]

        work = self._send(event, running, is_large=self._session.is_large)
        self._session.spawn(work).add_done_callback(ended)
        # Call count() last: if the client uses too much memory, count() disconnects it and cancels the goal's task.
        self._session.count()

    def cancel_goal(self, event: protocol.CancelActionGoal) -> None:
        running = self._goals.get(event.id)
        if running is not None:
            running.cancel()

    def _is_allowed(self, action: str) -> bool:
        what = "action, cancelling sending action goal for"
        return all(
            self._session.is_allowed("topics", f"{action}/{each}", what) for each in ("goal", "result")
        )

    async def _send(self, event: protocol.SendActionGoal, running: _Running, *, is_large: bool) -> None:
        try:
            await self._run(event, running, is_large=is_large)
        except (*REFUSALS, ROSInterruptException, TimeoutError) as error:
            self._session.shared.log.warning(
                "[Client %s] send_action_goal %s: %s", self._session.client.name, event.action, error
            )
            await self._result(event, str(error), _UNKNOWN, is_result=False)
        except Exception as error:  # noqa: BLE001 - the client waits for a result in any case
            self._reporter.report(error)
            await self._result(event, "the bridge failed on this goal", _UNKNOWN, is_result=False)

    async def _run(self, event: protocol.SendActionGoal, running: _Running, *, is_large: bool) -> None:
        self._session.require_write("sending goals")
        check_name("action", event.action)
        resolved = self._session.graph.node.resolve(event.action)
        if not self._session.graph.filters.publishable(f"{resolved}/goal"):
            raise BridgeError(f"topic [{resolved}/goal] may not be published by clients")
        class_: Any = _action_class(event.type)
        message = class_().action_goal.goal

        def fill() -> None:
            now = self._session.graph.node.now
            conversion.fill(message, conversion.request_values(message, event.arguments), now)

        if is_large:
            await self._session.shared.in_thread(fill)
        else:
            fill()

        action = self._action(resolved, class_)
        action.goals += 1
        try:
            goal = running.goal = action.client.send(message)
            if running.is_cancelled:
                goal.cancel()
            server = asyncio.ensure_future(_cancel_without_server(action.client, goal))
            try:
                async for feedback in goal:
                    if event.feedback:
                        await self._feedback(event, goal.id, feedback)
                error = server.result() if server.done() else None
                if (error or not server.done()) and action.goals == 1:
                    await self._leave(resolved, class_)
            finally:
                server.cancel()
            if error:
                raise error
            await self._ended(event, goal)
        finally:
            action.goals -= 1

    def _action(self, name: str, class_: Any) -> _Action:
        key = (name, class_)
        if key not in self._actions:
            # Import this here, because most clients do not need the messages of actionlib.
            from minirospy.ros.actionlib.actionlib.aio import ActionClient

            if len(self._actions) >= _MAX_ACTIONS:
                raise BridgeError(f"a client may use {_MAX_ACTIONS} actions")
            self._check_type(name, class_)
            try:
                client = ActionClient(self._session.graph.node, name, class_)
            except ValueError as error:
                # Another goal uses this action name with a different type.
                raise BridgeError(str(error)) from error
            self._actions[key] = _Action(client)
        return self._actions[key]

    def _check_type(self, name: str, class_: Any) -> None:
        """Raise BridgeError if the action's server uses another type than ``class_``.

        Check the type of the result topic: only the server publishes results, while an earlier client may have set the goal
        topic's type.
        """
        topic, wanted = f"{name}/result", class_().action_result._type
        snapshot = self._session.graph.snapshot
        known = snapshot.types.get(topic, ANY) if topic in snapshot.publishers else ANY
        if known not in (ANY, wanted):
            raise type_conflict(topic, wanted, known)

    async def _leave(self, name: str, class_: Any) -> None:
        """Unregister an action's topics, so that the action can be used with another type."""
        if action := self._actions.pop((name, class_), None):
            await asyncio.wait([self._session.graph.spawn(action.client.close())])

    async def _ended(self, event: protocol.SendActionGoal, goal: ClientGoal[Message, Message]) -> None:
        from minirospy.ros.actionlib.actionlib.aio import GoalError

        result: Any
        try:
            result = await goal
        except GoalError as error:
            result = error.result
        status = _STATUSES.get(goal.state)
        if status is None or result is None:
            why = f": {goal.text}" if goal.text else ""
            text = f"the goal was {goal.state.name.lower()}{why}"
            await self._result(event, text, _UNKNOWN if status is None else status, is_result=False)
        else:
            await self._result(event, conversion.values(result), status, is_result=True)

    async def _feedback(self, event: protocol.SendActionGoal, goal_id: str, feedback: Message) -> None:
        fields: dict[str, object] = {
            "op": "action_feedback",
            "action": event.action,
            "values": conversion.values(feedback),
        }
        messages = await self._encoded(event, fields)
        # A slow client may miss feedback, but not the result.
        client, key = self._session.client, ("feedback", goal_id)
        if texts := [each for each in messages if isinstance(each, str)]:
            client.send_texts(key, texts, newest_only=True)
        for each in messages:
            if isinstance(each, bytes):
                client.send_message(key, b"", each, newest_only=True)

    async def _result(
        self, event: protocol.SendActionGoal, values: object, status: int, *, is_result: bool
    ) -> None:
        fields: dict[str, object] = {
            "op": "action_result",
            "action": event.action,
            "values": values,
            "status": status,
            "result": is_result,
        }
        self._session.send_encoded(await self._encoded(event, fields))

    async def _encoded(self, event: protocol.SendActionGoal, fields: dict[str, object]) -> list[str | bytes]:
        if event.id is not None:
            fields["id"] = event.id
        shared = self._session.shared
        size = event.fragment_size or shared.options.fragment_size
        return await shared.encode(
            lambda: protocol.encode_messages(fields, event.compression, size, dump_json_in_pieces)
        )


async def _cancel_without_server(
    client: ActionClient[Any, Message, Message], goal: ClientGoal[Message, Message]
) -> Exception | None:
    """Wait for a server. If none appears in time, cancel the goal, so that it is not sent later; return the error."""
    try:
        await client.wait_for_server(SERVER_SECONDS)
    except Exception as error:  # noqa: BLE001 - the caller raises it once the goal has ended
        goal.cancel()
        return error
    return None


def _action_class(type_: str) -> type[Message]:
    """Return the class of an action type, also for a ROS 2 name. Raise UnknownTypeError if it is not installed."""
    package, _, short = type_.replace("/action/", "/", 1).partition("/")
    name = f"{package}/{short}" if short.endswith("Action") else f"{package}/{short}Action"
    try:
        return message_class(name)
    except UnknownTypeError:
        if short.endswith("Action"):
            raise
        raise UnknownTypeError(
            f"the action {type_[:200]} is not installed: its type is {name[:200]} in ROS 1"
        ) from None
