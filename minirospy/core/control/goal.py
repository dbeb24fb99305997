"""The goal of an action that a control loop executes. Several threads may finish it; the first one decides its outcome."""

from __future__ import annotations

from typing import Any, NamedTuple

from minirospy.core.graph.goals import GoalEvent

__all__ = ["CANCELLED", "MonitoredGoal", "Outcome"]


class Outcome(NamedTuple):
    """The outcome of a goal. ``result``: the values of the result message's first fields."""

    event: GoalEvent
    result: tuple[Any, ...] = ()


CANCELLED = Outcome(GoalEvent.CANCEL)


class MonitoredGoal:
    """An accepted goal. ``outcome``: None while active. ``reached``: one bit per joint, set when the joint has arrived."""

    def __init__(self) -> None:
        self.outcome: Outcome | None = None
        self.reached = 0
        self._decided: dict[None, Outcome] = {}

    def finish(self, outcome: Outcome) -> None:
        """Set the outcome, unless it is already set."""
        self.outcome = self._decided.setdefault(None, outcome)  # atomic
