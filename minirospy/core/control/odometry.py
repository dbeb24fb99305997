"""Odometry of wheeled bases: computes a pose from wheel angles. Source: http://wiki.ros.org/diff_drive_controller.

Times are in nanoseconds (int), lengths in metres, angles in radians.
"""

from __future__ import annotations

import math
from collections import deque

__all__ = ["AckermannOdometry", "DiffDriveOdometry", "Odometry"]

MIN_STEP = 100_000  # ns; minimum time over which to measure a velocity
STRAIGHT = 1e-6  # rad; a motion that turns by less than this in one cycle counts as straight


class Odometry:
    """The pose (x, y, heading) relative to the start, and the mean velocity of the last ``window`` cycles."""

    def __init__(self, window: int) -> None:
        self.x = 0.0
        self.y = 0.0
        self.heading = 0.0
        self.linear = 0.0  # m/s
        self.angular = 0.0  # rad/s
        self._time = 0
        self._speeds: deque[tuple[float, float]] = deque(maxlen=max(window, 1))

    def start(self, time: int) -> None:
        """Discard the measured velocities, and keep the pose."""
        self._speeds.clear()
        self._time = time

    def move(self, distance: float, turn: float, time: int) -> None:
        """Add one cycle's motion along an arc; the cycle ended at ``time``."""
        self._integrate(distance, turn)
        step = time - self._time
        if step < MIN_STEP:
            self._time = min(time, self._time)
            return
        self._time = time
        seconds = step * 1e-9
        speeds = self._speeds
        speeds.append((distance / seconds, turn / seconds))
        self.linear = sum(linear for linear, _ in speeds) / len(speeds)
        self.angular = sum(angular for _, angular in speeds) / len(speeds)

    def move_open_loop(self, linear: float, angular: float, time: int) -> None:
        """Add one cycle's motion at the commanded velocities."""
        seconds = max(time - self._time, 0) * 1e-9
        self._time = time
        self.linear = linear
        self.angular = angular
        self._integrate(linear * seconds, angular * seconds)

    def _integrate(self, distance: float, turn: float) -> None:
        """Move the pose along an arc, by exact integration."""
        heading = self.heading
        self.heading = heading + turn
        if abs(turn) < STRAIGHT:
            self.x += distance * math.cos(heading + turn / 2.0)
            self.y += distance * math.sin(heading + turn / 2.0)
        else:
            radius = distance / turn
            self.x += radius * (math.sin(self.heading) - math.sin(heading))
            self.y -= radius * (math.cos(self.heading) - math.cos(heading))


class DiffDriveOdometry(Odometry):
    """Odometry of a base with two wheels, or two rows of wheels, on one axis."""

    def __init__(self, window: int) -> None:
        super().__init__(window)
        self._left = 0.0  # m travelled by the left wheel
        self._right = 0.0

    def update(
        self,
        left: float,
        right: float,
        *,
        separation: float,
        left_radius: float,
        right_radius: float,
        time: int,
    ) -> None:
        """Add the wheels' motion since the last update, from their angles."""
        left_before, self._left = self._left, left * left_radius
        right_before, self._right = self._right, right * right_radius
        left_travel = self._left - left_before
        right_travel = self._right - right_before
        self.move((left_travel + right_travel) / 2.0, (right_travel - left_travel) / separation, time)


class AckermannOdometry(Odometry):
    """Odometry of a base with a driven rear wheel and a steered front wheel, each at the centre of its axle."""

    def __init__(self, window: int) -> None:
        super().__init__(window)
        self._travelled = 0.0  # m travelled by the rear wheel

    def update(self, wheel: float, steering: float, *, wheelbase: float, radius: float, time: int) -> None:
        """Add the motion since the last update: the distance from the driven wheel's angle, along the arc set by ``steering``."""
        before, self._travelled = self._travelled, wheel * radius
        travel = self._travelled - before
        self.move(travel, math.tan(steering) * travel / wheelbase, time)
