"""Joint trajectories: segments, the sequence of segments that one joint follows, and the points received in a message.

All times are in nanoseconds; segment times count from the start of the controller. Positions are in radians or metres, velocities
and accelerations per second. Source: http://wiki.ros.org/joint_trajectory_controller.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from typing import NamedTuple

from minirospy.base.errors import MinirospyError
from minirospy.core.control.goal import MonitoredGoal

__all__ = [
    "MAX_MAGNITUDE",
    "NEVER",
    "UNCHECKED",
    "ErrorCode",
    "JointPath",
    "JointTolerances",
    "PastTrajectoryError",
    "Point",
    "Points",
    "Segment",
    "State",
    "Tail",
    "TrajectoryError",
    "parse_points",
    "wraparound_offset",
]

NEVER = 1 << 100  # ns; a time that is later than any uptime, even if ROS time often jumps ahead
_SECOND = 1_000_000_000  # ns
MAX_MAGNITUDE = 1e100  # maximum position or derivative; larger values could overflow a segment's coefficients
# rad; so close to a half turn, rounding could reverse the shorter way: keep the sign of the position difference
_SINGULARITY = 1e-9


class ErrorCode(IntEnum):
    """The values of FollowJointTrajectoryResult.error_code."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class TrajectoryError(MinirospyError):
    """Raised if a trajectory is rejected. The text is ROS's, if ROS also rejects the trajectory."""


class PastTrajectoryError(TrajectoryError):
    """Raised if all points of a trajectory are in the past."""


class State(NamedTuple):
    """A joint's state at one end of a segment. A derivative that is not specified is None."""

    position: float
    velocity: float | None = 0.0
    acceleration: float | None = 0.0


class JointTolerances(NamedTuple):
    """The maximum errors of one joint during the motion and at its goal. Only tolerances above 0 are checked."""

    path_position: float = 0.0
    path_velocity: float = 0.0
    goal_position: float = 0.0
    goal_velocity: float = 0.0
    goal_time: int = 0  # ns after the end of the trajectory within which the joint may still reach its goal


UNCHECKED = JointTolerances()  # tolerances for a joint that stops, or moves without a goal


class Segment:
    """The motion of one joint between two times.

    The position is a linear, cubic or quintic polynomial: the highest degree for which both ends specify the derivatives. The
    polynomial matches the derivatives at both ends exactly; unless it is linear, it may therefore leave the range between the two
    positions. After the end, the joint holds the last position; as in ROS, a segment of zero duration holds the first one. Raise
    TrajectoryError if the end comes before the start.
    """

    __slots__ = ("coefficients", "duration", "end", "goal", "last", "start", "time_from_start", "tolerances")

    def __init__(
        self,
        start: int,
        first: State,
        end: int,
        last: State,
        goal: MonitoredGoal | None = None,
        tolerances: JointTolerances = UNCHECKED,
        time_from_start: int = 0,
    ) -> None:
        if end < start:
            raise TrajectoryError("Quintic spline segment can't be constructed: end_time < start_time.")
        self.start = start
        self.end = end
        self.duration = end - start
        self.last = last.position if end > start else first.position
        self.goal = goal
        self.tolerances = tolerances
        self.time_from_start = time_from_start
        self.coefficients = _coefficients(first, last, self.duration / _SECOND)

    def sample(self, time: int) -> tuple[float, float, float]:
        """Return position, velocity and acceleration. Outside the segment, the joint holds the position of the nearer end."""
        elapsed = time - self.start
        if elapsed > self.duration:
            return self.last, 0.0, 0.0
        c0, c1, c2, c3, c4, c5, v1, v2, v3, v4, a1, a2, a3 = self.coefficients
        if elapsed < 0:
            return c0, 0.0, 0.0
        x = elapsed / _SECOND
        return (
            c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5)))),
            c1 + x * (v1 + x * (v2 + x * (v3 + x * v4))),
            v1 + x * (a1 + x * (a2 + x * a3)),
        )


def _coefficients(first: State, last: State, t: float) -> tuple[float, ...]:
    """Return the polynomial's coefficients c0 to c5, then v1 to v4 of the velocity and a1 to a3 of the acceleration."""
    p0, v0, a0 = first
    p1, v1, a1 = last
    distance = p1 - p0
    c1 = c2 = c3 = c4 = c5 = 0.0

    if v0 is None or v1 is None:
        if t:
            c1 = distance / t
    elif a0 is None or a1 is None:
        c1 = v0
        if t:
            c2 = (3.0 * distance - (2.0 * v0 + v1) * t) / t**2
            c3 = (-2.0 * distance + (v0 + v1) * t) / t**3
    else:
        c1, c2 = v0, 0.5 * a0
        if t:
            c3 = (20.0 * distance - (12.0 * v0 + 8.0 * v1) * t - (3.0 * a0 - a1) * t**2) / (2.0 * t**3)
            c4 = (-30.0 * distance + (16.0 * v0 + 14.0 * v1) * t + (3.0 * a0 - 2.0 * a1) * t**2) / (
                2.0 * t**4
            )
            c5 = (12.0 * distance - 6.0 * (v0 + v1) * t + (a1 - a0) * t**2) / (2.0 * t**5)

    return p0, c1, c2, c3, c4, c5, 2.0 * c2, 3.0 * c3, 4.0 * c4, 5.0 * c5, 6.0 * c3, 12.0 * c4, 20.0 * c5


class Point(NamedTuple):
    """A point of a trajectory message, with values in the order of the message's joints. An empty derivative is not specified."""

    time: int  # time in ns from the start of the message's trajectory
    positions: Sequence[float]
    velocities: Sequence[float] = ()
    accelerations: Sequence[float] = ()

    def state(self, column: int, offset: float) -> State:
        """Return the state of the message's joint ``column``, with ``offset`` added to the position."""
        return State(
            self.positions[column] + offset,
            self.velocities[column] if self.velocities else None,
            self.accelerations[column] if self.accelerations else None,
        )


@dataclass(frozen=True)
class Points:
    """A message's valid points. The points before ``first`` were in the past when the message arrived."""

    points: Sequence[Point]
    times: Sequence[int]
    first: int
    stamp: int  # start of the trajectory in ns of ROS time; 0: in the next cycle
    warning: str = ""

    def next_after(self, elapsed: int) -> int:
        """Return the index of the first point after this time, or of the last point if there is none."""
        return min(bisect_right(self.times, elapsed), len(self.times) - 1)


def parse_points(names: Sequence[str], points: Sequence[Point], stamp: int, now: int) -> Points:
    """Check a message's points, and drop those before ``now`` (ROS time).

    Raise TrajectoryError if no points remain, if their times are not strictly increasing, or if their values are invalid.
    """
    times = [point.time for point in points]
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise TrajectoryError(
            "Trajectory message contains waypoints that are not strictly increasing in time."
        )

    start = stamp or now
    first = bisect_right(times, now - start)
    if first == len(points):
        past = (now - start - times[-1]) / _SECOND
        raise PastTrajectoryError(
            f"Dropping all {len(points)} trajectory point(s), as they occur before the current time.\n"
            f"Last point is {past:.6f}s in the past."
        )
    is_start_repeated = first == 1 and times[0] == 0 and stamp == 0
    warning = ""
    if first and not is_start_repeated:
        warning = (
            f"Dropping first {first} trajectory point(s) out of {len(points)}, as they occur before the current time.\n"
            f"First valid point will be reached in {(start + times[first] - now) / _SECOND:.3f}s."
        )

    for index in range(first, len(points)):
        _check_sizes(names, points, index, index == first)
        _check_values(names, points[index], index)
    if times[first] < 0:
        raise TrajectoryError("Quintic spline segment can't be constructed: end_time < start_time.")
    return Points(points, times, first, stamp, warning)


def _check_sizes(names: Sequence[str], points: Sequence[Point], index: int, is_first: bool) -> None:
    """Raise TrajectoryError, with ROS's text, if the number of values does not match the number of joints."""
    _, positions, velocities, accelerations = points[index]
    count = len(positions)
    if (velocities and len(velocities) != count) or (accelerations and len(accelerations) != count):
        raise TrajectoryError("Size mismatch in trajectory point position, velocity or acceleration data.")
    if count == len(names):
        return
    if is_first and not count:
        raise TrajectoryError(
            "Quintic spline segment can't be constructed: Endpoint positions can't be empty."
        )
    if not is_first and count != len(points[index - 1].positions):
        raise TrajectoryError(
            "Can't construct segment from ROS message: Start/end points data size mismatch."
        )
    raise TrajectoryError(
        f"Invalid trajectory point at index: {index}. "
        "Size mismatch in joint names, position, velocity or acceleration data."
    )


def _check_values(names: Sequence[str], point: Point, index: int) -> None:
    """Raise TrajectoryError if a value is not finite, or is absurdly large."""
    for kind, values in (
        ("position", point.positions),
        ("velocity", point.velocities),
        ("acceleration", point.accelerations),
    ):
        if sum(map(abs, values)) < MAX_MAGNITUDE:
            continue
        name, value = next(
            (name, value)
            for name, value in zip(names, values, strict=True)
            if not abs(value) < MAX_MAGNITUDE / len(names)
        )
        raise TrajectoryError(
            f"Invalid trajectory point at index: {index}. "
            f"The {kind} of joint '{name}' is {value}, which is not a usable number."
        )


class Tail(NamedTuple):
    """The part of a joint's path that runs between the points of a message."""

    points: Points
    column: int  # the joint's index in the message
    first: int  # the index of the first point
    start: int  # start of the message's trajectory, in ns
    offset: float  # offset of the positions in rad, a number of whole turns
    tolerances: JointTolerances


class JointPath:
    """The segments that one joint follows. At the end, the joint holds the last position.

    ``current`` is the segment at the time of the last :meth:`advance`, at first the first segment. Segments between a message's
    points are constructed when they are reached.
    """

    def __init__(
        self, segments: Sequence[Segment], tail: Tail | None = None, goal: MonitoredGoal | None = None
    ) -> None:
        self._segments = segments
        self._tail = tail
        self._goal = goal  # the goal of the tail's segments
        self._count = len(segments)
        if tail is not None:
            self._count += len(tail.points.times) - 1 - tail.first
        self._index = 0
        self.current = segments[0]
        self.next_start = self._start(1)  # ns; start of the next segment, or NEVER in the last one

    def advance(self, time: int) -> None:
        """Make the segment at ``time`` the current one. Times must not decrease."""
        while time >= self.next_start:
            self._index += 1
            self.next_start = self._start(self._index + 1)
        self.current = self._build(self._index)

    def set_goal(self, goal: MonitoredGoal | None) -> None:
        """Assign the current and all later segments to another goal. The segments keep their tolerances."""
        self._goal = goal
        self.current.goal = goal
        for segment in self._segments[self._index :]:
            segment.goal = goal

    def sample(self, time: int) -> tuple[float, float, float] | None:
        """Return position, velocity and acceleration at any time, or None before the path's start."""
        index = self._find(time)
        return self._segment(index).sample(time) if index >= 0 else None

    def until(self, time: int) -> list[Segment]:
        """Return the segments from the current one to the one at ``time``."""
        return [self._segment(index) for index in range(self._index, self._find(time) + 1)]

    def _find(self, time: int) -> int:
        """Return the index of the segment at a time, or -1 before the first."""
        index = self._index if time >= self.current.start else -1
        while time >= self._start(index + 1):
            index += 1
        return index

    def _start(self, index: int) -> int:
        """Return the time at which a segment starts, or NEVER after the last."""
        if index < len(self._segments):
            return self._segments[index].start
        if index >= self._count or self._tail is None:
            return NEVER
        return self._tail.start + self._tail.points.times[self._tail.first + index - len(self._segments)]

    def _segment(self, index: int) -> Segment:
        return self.current if index == self._index else self._build(index)

    def _build(self, index: int) -> Segment:
        if index < len(self._segments):
            return self._segments[index]
        assert self._tail is not None
        points, column, first, start, offset, tolerances = self._tail
        first += index - len(self._segments)
        before, after = points.points[first], points.points[first + 1]
        return Segment(
            start + before.time,
            before.state(column, offset),
            start + after.time,
            after.state(column, offset),
            self._goal,
            tolerances,
            before.time,
        )


def wraparound_offset(before: float, after: float) -> float:
    """Return the multiple of 2 pi to add to ``after`` so that a continuous joint takes the shorter way from ``before``."""
    distance = math.remainder(after - before, math.tau)
    if math.pi - abs(distance) < _SINGULARITY:
        distance = math.copysign(distance, after - before)
    return before + distance - after
