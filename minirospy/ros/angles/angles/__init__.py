"""angles: distances between angles in radians, with and without limits. Source: http://wiki.ros.org/angles."""

from __future__ import annotations

from math import fmod, pi
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from math import fabs

__all__ = [
    "_find_min_max_delta",
    "fabs",
    "fmod",
    "normalize_angle",
    "normalize_angle_positive",
    "pi",
    "shortest_angular_distance",
    "shortest_angular_distance_with_large_limits",
    "shortest_angular_distance_with_limits",
    "two_pi_complement",
]

_TURN = 2.0 * pi


def normalize_angle_positive(angle: float) -> float:
    """Normalize an angle to the range 0 to 2 pi."""
    return angle % _TURN


def normalize_angle(angle: float) -> float:
    """Normalize an angle to the range -pi to pi."""
    positive = normalize_angle_positive(angle)
    return positive - _TURN if positive > pi else positive


def shortest_angular_distance(from_angle: float, to_angle: float) -> float:
    """Return the shortest rotation from one angle to another, in the range -pi to pi."""
    return normalize_angle(to_angle - from_angle)


def two_pi_complement(angle: float) -> float:
    """Return the rotation in the opposite direction that reaches the same angle, in the range -2 pi to 2 pi."""
    if abs(angle) > _TURN:
        angle = fmod(angle, _TURN)
    return angle - _TURN if angle > 0 else angle + _TURN


def shortest_angular_distance_with_limits(
    from_angle: float, to_angle: float, left_limit: float, right_limit: float
) -> tuple[bool, float]:
    """Return (success, rotation): the shortest rotation to ``to_angle`` that stays within the limits.

    All angles are from -pi to pi. The limits run counter-clockwise from left to right: [0.25, -0.25] contains pi, but not 0.
    """
    is_inside, least, greatest = _find_min_max_delta(from_angle, left_limit, right_limit)
    turn = shortest_angular_distance(from_angle, to_angle)
    other = two_pi_complement(turn)
    if is_inside:
        for each in (turn, other):
            if least <= each <= greatest:
                return True, each
        # The target is outside the limits: rotate towards the limit closer to the target.
        _, least, greatest = _find_min_max_delta(to_angle, left_limit, right_limit)
        least, greatest = greatest, least

    if abs(least) < abs(greatest):
        return False, min(turn, other)
    if abs(least) > abs(greatest):
        return False, max(turn, other)
    return False, turn if abs(turn) < abs(other) else other


def shortest_angular_distance_with_large_limits(
    from_angle: float, to_angle: float, left_limit: float, right_limit: float
) -> tuple[bool, float]:
    """Like :func:`shortest_angular_distance_with_limits`, but the limits may lie outside the range -pi to pi.

    The left limit must be less than the right one.
    """
    turn = shortest_angular_distance(from_angle, to_angle)
    other = two_pi_complement(turn)
    if abs(turn) > abs(other):
        turn, other = other, turn
    if left_limit <= right_limit:
        for each in (turn, other):
            if left_limit <= from_angle + each <= right_limit:
                return left_limit <= from_angle <= right_limit, each
    return False, turn


def _find_min_max_delta(
    from_angle: float, left_limit: float, right_limit: float
) -> tuple[bool, float, float]:
    """Return whether an angle is within the limits, and how far it can rotate in each direction before reaching a limit."""
    to_left = shortest_angular_distance(from_angle, left_limit)
    to_right = shortest_angular_distance(from_angle, right_limit)
    left_round, right_round = two_pi_complement(to_left), two_pi_complement(to_right)
    if to_left == 0:
        return True, to_left, max(to_right, right_round)
    if to_right == 0:
        return True, min(to_left, left_round), to_right

    least, least_round = min(to_left, left_round), max(to_left, left_round)
    greatest, greatest_round = max(to_right, right_round), min(to_right, right_round)
    if least <= greatest_round or greatest >= least_round:
        return left_limit == -pi and right_limit == pi, greatest_round, least_round
    return True, least, greatest
