"""Keyboard-controlled sliders for joints: the selection, the effect of each key, and the lines to show. Pure.

Source: http://wiki.ros.org/joint_state_publisher_gui, which has the same sliders, Center and Randomize.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import NamedTuple

from minirospy.ros.robot_state_publisher.joints import FreeJoint

__all__ = ["HINT", "Row", "Sliders"]

HINT = "up, down: select; left, right: 1 % of the range; < >: 10 %; 0: zero; c: center all; r: randomize all; q: quit"
_STEPS = {"left": -0.01, "right": 0.01, "<": -0.1, ">": 0.1, ",": -0.1, ".": 0.1}
_MOVES = {"up": -1, "down": 1, "k": -1, "j": 1}


class Row(NamedTuple):
    """A joint's line on the screen: its name, bar, position and limits, and whether it is selected."""

    name: str
    bar: str
    text: str
    is_selected: bool


class Sliders:
    """Sliders for the adjustable joints, one of them selected. ``random_`` generates random positions."""

    def __init__(self, joints: Mapping[str, FreeJoint], random_: random.Random | None = None) -> None:
        self._joints = joints
        self._names = [*joints]
        self._random = random_ or random.Random()
        self._selected = 0

    def press(self, key: str) -> bool:
        """Process a key; return whether a position has changed."""
        if not self._names:
            return False
        if key in _MOVES:
            self._selected = (self._selected + _MOVES[key]) % len(self._names)
            return False

        joint = self._joints[self._names[self._selected]]
        if key in _STEPS:
            self._set(joint, _position(joint) + _STEPS[key] * (joint.upper - joint.lower))
        elif key == "0":
            self._set(joint, joint.zero)
        elif key == "c":
            for each in self._joints.values():
                self._set(each, each.zero)
        elif key == "r":
            for each in self._joints.values():
                self._set(each, self._random.uniform(each.lower, each.upper))
        else:
            return False
        return True

    @staticmethod
    def _set(joint: FreeJoint, position: float) -> None:
        joint.position = min(max(position, joint.lower), joint.upper)

    def rows(self, most: int, width: int = 24) -> list[Row]:
        """Return the lines for up to ``most`` joints around the selected one; a bar has ``width`` characters."""
        first = min(max(self._selected - most // 2, 0), max(len(self._names) - most, 0))
        return [
            self._row(name, width, number == self._selected)
            for number, name in enumerate(self._names)
            if first <= number < first + most
        ]

    def _row(self, name: str, width: int, is_selected: bool) -> Row:
        joint = self._joints[name]
        span = joint.upper - joint.lower
        share = (_position(joint) - joint.lower) / span if span > 0 else 0.5
        place = round(min(max(share, 0.0), 1.0) * (width - 1))
        bar = "".join("|" if at == place else "-" for at in range(width))
        return Row(name, bar, f"{_position(joint):8.3f}  ({joint.lower:g} .. {joint.upper:g})", is_selected)


def _position(joint: FreeJoint) -> float:
    return joint.zero if joint.position is None else joint.position
