"""Code shared by the asyncio action client and server: handling of the action's class, topics and tasks."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Protocol, TypeVar, cast

from minirospy import Node
from minirospy.aio.handle import Handle
from minirospy.base.errors import MinirospyError
from minirospy.core.graph.goals import GoalState
from minirospy.core.idl.protocols import Action
from minirospy.ros.actionlib.actionlib.spec import ActionTypes, action_types

__all__ = ["WAITING", "ActionClass", "ActionEnd", "GoalError"]

_G_co = TypeVar("_G_co", covariant=True)
_R_co = TypeVar("_R_co", covariant=True)
_F_co = TypeVar("_F_co", covariant=True)

WAITING = 1000  # queue size in messages, per action topic and for each goal's unread feedback


class _WithGoal(Protocol[_G_co]):
    @property
    def goal(self) -> _G_co: ...


class _WithResult(Protocol[_R_co]):
    @property
    def result(self) -> _R_co: ...


class _WithFeedback(Protocol[_F_co]):
    @property
    def feedback(self) -> _F_co: ...


class ActionClass(Protocol[_G_co, _R_co, _F_co]):
    """The attributes of an action class that refer to its goal, result and feedback classes."""

    @property
    def action_goal(self) -> _WithGoal[_G_co]: ...

    @property
    def action_result(self) -> _WithResult[_R_co]: ...

    @property
    def action_feedback(self) -> _WithFeedback[_F_co]: ...


class GoalError(MinirospyError):
    """Raised if a goal ends without success.

    ``text`` and ``result`` (if any) come from the server; ``state`` is the final state.

    A server's ``execute`` raises this error to abort the goal with a status text and a result. ``result`` may have any
    type that ``execute`` may return.
    """

    def __init__(self, text: str = "", result: object = None, state: GoalState = GoalState.ABORTED) -> None:
        super().__init__(f"the goal was {state.name.lower()}" + (f": {text}" if text else ""))
        self.text = text
        self.result = result
        self.state = state


class ActionEnd(Handle):
    """Base class of ActionClient and ActionServer: manages their topics and the tasks that read them."""

    def __init__(self, node: Node, name: str, action: object) -> None:
        self.name = node.resolve(name)
        self._node = node
        self._types: ActionTypes = action_types(cast("type[Action]", action))
        self._tasks: set[asyncio.Task[None]] = set()
        self._is_closed = False

    def _topic(self, name: str) -> str:
        # Resolve each topic's full name, because topics can be remapped separately.
        return self._node.resolve(f"{self.name}/{name}")

    def _start(self, work: Coroutine[object, None, None]) -> asyncio.Task[None]:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _end_tasks(self) -> None:
        tasks = self._tasks - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
