"""A simulated safety scanner: compute ranges and fields from a room's walls and a person. Pure.

The geometry is that of SICK's nanoScan3 as its ROS 1 driver publishes it: 1651 beams over 275 degrees. Lengths are in
metres, angles in radians; x is straight ahead of the scanner and y to its left.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from typing import NamedTuple

__all__ = ["ANGLE_INCREMENT", "ANGLE_MIN", "BEAMS", "FIELDS", "Circle", "Room", "Scan", "Wall"]

BEAMS = 1651
ANGLE_MIN = -2.39983
ANGLE_INCREMENT = 0.0029088794
RANGE_MIN = 0.1
RANGE_MAX = 40.0
NOISE = 0.004  # standard deviation of a range, in metres
FIELDS = (0.4, 0.2)  # reach of the warning field and of the protective field, in metres

_PLAIN, _REFLECTOR = 90.0, 250.0
_DARK_EDGE = 0.35  # minimum brightness, from 0 to 1, of a surface seen at a flat angle


class Wall(NamedTuple):
    """A straight wall between two points. If ``is_reflector`` is true, its intensity is that of a reflector."""

    x1: float
    y1: float
    x2: float
    y2: float
    is_reflector: bool = False


class Circle(NamedTuple):
    """A round object seen from above, such as a person's legs."""

    x: float
    y: float
    radius: float = 0.15

    @property
    def distance(self) -> float:
        """The distance from the scanner to the circle's closest point; never negative."""
        return max(0.0, math.hypot(self.x, self.y) - self.radius)


class Scan(NamedTuple):
    """One rotation. For each beam: a range (``inf`` if nothing was hit), an intensity, and whether it hit a reflector."""

    ranges: list[float]
    intensities: list[float]
    is_reflector: list[bool]

    @property
    def nearest(self) -> float:
        """The smallest range of all beams."""
        return min(self.ranges)

    def fields(self) -> tuple[bool, bool]:
        """Return whether the warning field and the protective field are free."""
        nearest = self.nearest
        return nearest >= FIELDS[0], nearest >= FIELDS[1]


# A room of 6 m by 4 m, with the scanner 1 m from the rear wall, a door on the left and a reflector on the wall ahead
WALLS = (
    Wall(-1.0, -2.0, 5.0, -2.0),
    Wall(5.0, -2.0, 5.0, -0.3),
    Wall(5.0, -0.3, 5.0, 0.3, is_reflector=True),
    Wall(5.0, 0.3, 5.0, 2.0),
    Wall(5.0, 2.0, 2.5, 2.0),
    Wall(1.5, 2.0, -1.0, 2.0),
    Wall(-1.0, 2.0, -1.0, -2.0),
)


class Room:
    """Fixed walls, and a person who can move. ``seed`` makes the noise reproducible."""

    def __init__(self, walls: Sequence[Wall] = WALLS, seed: int | None = None) -> None:
        self.person: Circle | None = None
        self._noise = random.Random(seed)
        self._walls = [_nearest_wall(_angle(beam), walls) for beam in range(BEAMS)]

    def scan(self, noise: float = NOISE) -> Scan:
        """Simulate one scan of the room."""
        ranges, intensities, reflectors = [], [], []
        gauss = self._noise.gauss
        person = self._person_ranges()
        for beam, (distance, brightness, is_reflector) in enumerate(self._walls):
            near = person.get(beam)
            if near is not None and near < distance:
                distance, brightness, is_reflector = near, _PLAIN, False  # noqa: PLW2901
            if distance >= 0.999 * RANGE_MAX:
                ranges.append(math.inf)
                intensities.append(0.0)
            else:
                ranges.append(
                    max(RANGE_MIN, distance + gauss(0.0, noise)) if noise else max(RANGE_MIN, distance)
                )
                intensities.append(brightness)
            reflectors.append(is_reflector)
        return Scan(ranges, intensities, reflectors)

    def _person_ranges(self) -> dict[int, float]:
        """Return a dict from beam to distance, for the beams that hit the person."""
        person = self.person
        if person is None:
            return {}
        away = math.hypot(person.x, person.y)
        if away <= person.radius:
            return dict.fromkeys(range(BEAMS), RANGE_MIN)
        middle = math.atan2(person.y, person.x)
        half = math.asin(person.radius / away)
        first = max(0, math.ceil((middle - half - ANGLE_MIN) / ANGLE_INCREMENT))
        last = min(BEAMS - 1, math.floor((middle + half - ANGLE_MIN) / ANGLE_INCREMENT))
        found = {}
        for beam in range(first, last + 1):
            off = _angle(beam) - middle
            across = person.radius**2 - (away * math.sin(off)) ** 2
            found[beam] = away * math.cos(off) - math.sqrt(max(0.0, across))
        return found


def _angle(beam: int) -> float:
    return ANGLE_MIN + beam * ANGLE_INCREMENT


def _nearest_wall(angle: float, walls: Sequence[Wall]) -> tuple[float, float, bool]:
    """Return the distance to the first wall that a beam hits, the wall's brightness, and whether the wall is a reflector."""
    dx, dy = math.cos(angle), math.sin(angle)
    nearest: tuple[float, float, bool] = (math.inf, 0.0, False)
    for wall in walls:
        ex, ey = wall.x2 - wall.x1, wall.y2 - wall.y1
        cross = dx * ey - dy * ex
        if abs(cross) < 1e-12:
            continue
        distance = (wall.x1 * ey - wall.y1 * ex) / cross
        along = (wall.x1 * dy - wall.y1 * dx) / cross
        if distance > 0 and 0 <= along <= 1 and distance < nearest[0]:
            facing = max(_DARK_EDGE, abs(cross) / math.hypot(ex, ey))
            nearest = (distance, (_REFLECTOR if wall.is_reflector else _PLAIN) * facing, wall.is_reflector)
    return nearest
