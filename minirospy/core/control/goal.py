"""The goal of an action that a control loop follows: one of several threads decides its outcome."""

from __future__ import annotations

from typing import Any, NamedTuple

from minirospy.core.graph.goals import GoalEvent

__all__ = ["CANCELLED", "MonitoredGoal", "Outcome"]


class Outcome(NamedTuple):
    """The outcome of a goal. ``result``: the first fields of the result's message."""

    event: GoalEvent
    result: tuple[Any, ...] = ()


CANCELLED = Outcome(GoalEvent.CANCEL)


class MonitoredGoal:
    """An accepted goal. ``outcome`` is None while it is active; ``reached`` has a bit for each joint that is at its end."""

    def __init__(self) -> None:
        self.outcome: Outcome | None = None
        self.reached = 0
        self._decided: dict[None, Outcome] = {}

    def finish(self, outcome: Outcome) -> None:
        """Decide the outcome, unless another one was decided before."""
        self.outcome = self._decided.setdefault(None, outcome)  # atomic
