"""Finds an action's goal, result and feedback classes, given an action class such as `TestAction`."""

from __future__ import annotations

from typing import NamedTuple

from minirospy.base.errors import MinirospyError
from minirospy.core.idl.protocols import Action, ActionFeedback, ActionGoal, ActionResult, Message

__all__ = [
    "CANCEL_SECONDS",
    "SEND_SECONDS",
    "SERVER_SECONDS",
    "TAKES_FAST_ANSWERS",
    "ActionException",
    "ActionTypes",
    "action_types",
]


# Connection header field on goal topics, set by minirospy clients to announce that they accept fast responses.
TAKES_FAST_ANSWERS = {"takes_fast_answers": "1"}

# Seconds for which the server delays goals from other clients.
# Python's actionlib drops results that arrive before send_goal returns.
SEND_SECONDS = 1e-3

# Seconds to delay cancel requests, because their goals, sent earlier on another connection, are delayed too.
CANCEL_SECONDS = 3 * SEND_SECONDS

# Seconds for a server to reconnect after a lost connection; after that, its goals count as LOST.
SERVER_SECONDS = 5.0


class ActionException(MinirospyError):
    """Raised if the class is not an action class."""


class ActionTypes(NamedTuple):
    """An action's message classes; those named ``action_...`` are used on its topics."""

    action_goal: type[ActionGoal]
    action_result: type[ActionResult]
    action_feedback: type[ActionFeedback]
    goal: type[Message]
    result: type[Message]
    feedback: type[Message]


def action_types(action: type[Action]) -> ActionTypes:
    """Return the message classes of an action class, such as ``runningLedAction``.

    Raise ActionException if ``action`` is not an action class.
    """
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
