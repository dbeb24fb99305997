"""Steers a turtle along the sides of a square: input poses, output velocities and log lines. Pure.

Source: the behaviour of draw_square in turtlesim 0.10.2.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

from minirospy.ros.turtlesim.world import Pose

__all__ = ["Order", "Square"]

_SIDE_METRES = 2.0
_NEAR_METRES, _NEAR_RADIANS = 0.1, 0.01
_STILL = 0.0001  # a turtle slower than this (m/s or rad/s) counts as stopped


class Order(NamedTuple):
    """Velocities to command: metres per second forward, radians per second to the left."""

    linear: float = 0.0
    angular: float = 0.0


class _Phase(Enum):
    FORWARD = Order(linear=1.0)
    TURN = Order(angular=0.4)


class Square:
    """Drives a square. Its goals alternate: two metres ahead, or a quarter turn to the left."""

    def __init__(self) -> None:
        self._goal: Pose | None = None
        self._phase = _Phase.FORWARD
        self._is_stopping = False

    def step(self, pose: Pose, linear: float, angular: float) -> tuple[Order | None, list[str]]:
        """Return the velocity to command (None: unchanged) and the lines to log.

        The turtle is at ``pose``, and moves with the velocities ``linear`` and ``angular``.
        """
        if self._goal is None:
            self._goal, lines = _new_goal(_ahead(pose))
            return self._go(pose), lines
        if not self._is_stopping:
            return self._go(pose), []
        if linear >= _STILL or angular >= _STILL:
            return Order(), []

        self._is_stopping = False
        if self._phase is _Phase.FORWARD:
            self._phase, goal = _Phase.TURN, _quarter_turn(pose)
        else:
            self._phase, goal = _Phase.FORWARD, _ahead(pose)
        self._goal, lines = _new_goal(goal)
        return None, ["Reached goal", *lines]

    def _go(self, pose: Pose) -> Order:
        assert self._goal is not None
        goal = self._goal
        self._is_stopping = (
            abs(pose.x - goal.x) < _NEAR_METRES
            and abs(pose.y - goal.y) < _NEAR_METRES
            and abs(pose.theta - goal.theta) < _NEAR_RADIANS
        )
        return Order() if self._is_stopping else self._phase.value


def _ahead(pose: Pose) -> Pose:
    x = pose.x + math.cos(pose.theta) * _SIDE_METRES
    return Pose(x, pose.y + math.sin(pose.theta) * _SIDE_METRES, pose.theta)


def _quarter_turn(pose: Pose) -> Pose:
    theta = math.fmod(pose.theta + math.pi / 2, 2 * math.pi)
    return pose._replace(theta=theta - 2 * math.pi if theta >= math.pi else theta)


def _new_goal(goal: Pose) -> tuple[Pose, list[str]]:
    return goal, [f"New goal [{goal.x:f} {goal.y:f}, {goal.theta:f}]"]
