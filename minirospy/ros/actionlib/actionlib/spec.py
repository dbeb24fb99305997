"""The messages of an action, by its class: `TestAction` -> its goal, result and feedback, with and without header."""

from __future__ import annotations

from typing import NamedTuple

from minirospy.base.errors import MinirospyError
from minirospy.core.idl.protocols import Action, ActionFeedback, ActionGoal, ActionResult, Message

__all__ = [
    "CANCEL_SECONDS",
    "SEND_SECONDS",
    "TAKES_FAST_ANSWERS",
    "ActionException",
    "ActionTypes",
    "action_types",
]


TAKES_FAST_ANSWERS = {"takes_fast_answers": "1"}
"""What our clients send in the connection header of their goals."""

SEND_SECONDS = 1e-3
"""Goals of third-party clients wait for this long.

actionlib in Python drops what comes before its send_goal has returned: a result, too.
"""

CANCEL_SECONDS = 3 * SEND_SECONDS
"""Cancels wait for this long: the goal that was sent before comes by another connection, and waits itself."""


class ActionException(MinirospyError):
    """A class that is not an action."""


class ActionTypes(NamedTuple):
    """The message classes of an action; the ``action_`` ones are those that travel."""

    action_goal: type[ActionGoal]
    action_result: type[ActionResult]
    action_feedback: type[ActionFeedback]
    goal: type[Message]
    result: type[Message]
    feedback: type[Message]


def action_types(action: type[Action]) -> ActionTypes:
    """Return the message classes of an action's class, such as ``runningLedAction``. Raise ActionException."""
    try:
        parts = action()
        goal, result, feedback = parts.action_goal, parts.action_result, parts.action_feedback
        return ActionTypes(
            type(goal),
            type(result),
            type(feedback),
            type(goal.goal),
            type(result.result),
            type(feedback.feedback),
        )
    except (AttributeError, TypeError):
        raise ActionException(f"Type is not an action spec: {action}") from None
