"""The decisions of a JointTrajectoryController: the joints' desired states in each cycle, and the outcomes of its goals.

It replaces, holds and stops trajectories, and checks tolerances. Times are in nanoseconds, of ROS time or of the uptime, which
starts at 0 and is the sum of the cycles' periods. Source: http://wiki.ros.org/joint_trajectory_controller.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from minirospy.core.control.controller import ControllerError
from minirospy.core.control.goal import MonitoredGoal, Outcome
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.trajectory import (
    MAX_MAGNITUDE,
    NEVER,
    UNCHECKED,
    ErrorCode,
    JointPath,
    JointTolerances,
    Point,
    Points,
    Segment,
    State,
    Tail,
    TrajectoryError,
    parse_points,
    wraparound_offset,
)
from minirospy.core.graph.goals import GoalEvent
from minirospy.core.urdf.model import JointType, Robot

__all__ = ["FollowedJoint", "GoalTolerance", "JointsError", "Plan", "TrajectoryFollower", "read_joints"]

_SECOND = 1_000_000_000  # ns
_MAX_REQUESTS = 100  # maximum trajectories queued while the loop is paused; beyond it, the oldest are dropped
_remainder, _turn = math.remainder, math.tau
_SUCCEEDED = Outcome(GoalEvent.SUCCEED, (ErrorCode.SUCCESSFUL, ""))


class JointsError(TrajectoryError):
    """Raised if a trajectory's joints do not match the controller's."""


class FollowedJoint(NamedTuple):
    """A joint. A continuous joint turns without limits, and takes the shorter way to a target."""

    name: str
    is_continuous: bool = False
    tolerances: JointTolerances = JointTolerances()


class GoalTolerance(NamedTuple):
    """A tolerance in a goal message. A positive value overrides the controller's, a negative one disables it, and 0 keeps it."""

    name: str
    position: float
    velocity: float


class Plan(NamedTuple):
    """A checked trajectory. For each joint of the controller: its column in the message (None: not there), its tolerances."""

    points: Points
    columns: Sequence[int | None]
    tolerances: Sequence[JointTolerances]


class TrajectoryFollower:
    """Executes trajectories for several joints.

    The loop's thread calls :meth:`start`, :meth:`update` and :meth:`stop`. Other threads call :meth:`plan`, :meth:`request_plan`
    and :meth:`request_hold`; the next update carries out their requests. A new trajectory therefore starts from the old one's
    states in that same cycle, no matter how long its message took to arrive and to be checked.

    The lists have one number per joint, and are replaced in each cycle. ``stop_duration``: ns over which the joints slow down
    before they hold their position; if it is 0, they hold their actual position immediately.
    """

    def __init__(
        self, joints: Sequence[FollowedJoint], stop_duration: int = 0, allows_partial_goals: bool = False
    ) -> None:
        self.joints = joints
        self._names = [joint.name for joint in joints]
        self._continuous = [joint.is_continuous for joint in joints]
        self._all_reached = (1 << len(joints)) - 1
        self._stop_duration = stop_duration
        self._allows_partial_goals = allows_partial_goals
        self._requests: deque[tuple[Plan | None, MonitoredGoal | None]] = deque(maxlen=_MAX_REQUESTS)
        self._paths: list[JointPath] = []
        self.is_running = False
        self.time = 0  # ROS time of the last update, in ns
        self.uptime = 0  # uptime at the last update, in ns
        self._clock = (0, 0, 0)  # time, period and uptime of the last update, as read by other threads
        self.positions: list[float] = []  # desired
        self.velocities: list[float] = []  # desired
        self.accelerations: list[float] = []  # desired
        self.position_errors: list[float] = []  # desired minus actual
        self.velocity_errors: list[float] = []

    def start(self, time: int, positions: Sequence[float], velocities: Sequence[float]) -> None:
        """Hold the joints at their actual positions, which must be finite, starting with the next update."""
        self._requests.clear()
        self.time, self.uptime = time, 0
        self._clock = (time, 0, 0)
        count = len(self.joints)
        self.positions = list(positions)
        self.velocities = [velocity if math.isfinite(velocity) else 0.0 for velocity in velocities]
        self.accelerations = [0.0] * count
        self.position_errors = [0.0] * count
        self.velocity_errors = [0.0] * count
        self._hold(self.positions, None)
        self.is_running = True

    def stop(self) -> None:
        """Discard the trajectory; do nothing until the next start."""
        self.is_running = False
        self._requests.clear()

    def plan(
        self,
        names: Sequence[str],
        points: Sequence[Point],
        stamp: int,
        tolerances: Sequence[JointTolerances] | None = None,
    ) -> Plan:
        """Check a message's trajectory; return the plan for :meth:`request_plan`. ``stamp``: ns of ROS time, or 0 to start now.

        Raise JointsError or TrajectoryError if the trajectory is rejected.
        """
        columns = self.columns(names)
        time, period, _ = self._clock
        return Plan(
            parse_points(names, points, stamp, time + period),
            columns,
            tolerances or [joint.tolerances for joint in self.joints],
        )

    def goal_tolerances(
        self, path: Sequence[GoalTolerance], goal: Sequence[GoalTolerance], goal_time: int
    ) -> list[JointTolerances]:
        """Return the joints' tolerances, overridden by those in a goal message. ``goal_time`` (ns) follows the same rules."""
        found = {joint.name: joint.tolerances for joint in self.joints}
        for name, position, velocity in path:
            if default := found.get(name):
                found[name] = default._replace(
                    path_position=_override(default.path_position, position),
                    path_velocity=_override(default.path_velocity, velocity),
                )
        for name, position, velocity in goal:
            if default := found.get(name):
                found[name] = default._replace(
                    goal_position=_override(default.goal_position, position),
                    goal_velocity=_override(default.goal_velocity, velocity),
                )
        return [
            tolerances._replace(goal_time=int(_override(tolerances.goal_time, goal_time)))
            for tolerances in found.values()
        ]

    def columns(self, names: Sequence[str]) -> list[int | None]:
        """Return the index in ``names`` of each of the controller's joints, or None for a joint that ``names`` lacks.

        Raise JointsError if ``names`` has unknown or duplicate names, or too few.
        """
        places = {name: column for column, name in enumerate(names)}
        is_complete = len(names) == len(self._names)
        if not (is_complete or self._allows_partial_goals) or not names or len(places) != len(names):
            raise JointsError(
                "Cannot create trajectory from message. It does not contain the expected joints."
            )
        columns = [places.pop(name, None) for name in self._names]
        if places:
            raise JointsError(
                "Cannot create trajectory from message. It does not contain the expected joints."
            )
        return columns

    def request_plan(self, plan: Plan, goal: MonitoredGoal | None) -> None:
        """Execute a plan, starting with the next update or at its start time."""
        self._requests.append((plan, goal))

    def request_hold(self, goal: MonitoredGoal | None = None) -> None:
        """Stop all joints and hold their positions. The goal succeeds when all joints have stopped."""
        self._requests.append((None, goal))

    @property
    def waiting(self) -> int:
        """Return the number of plans and holds that the next update will carry out. Beyond 100, the oldest are dropped."""
        return len(self._requests)

    def sample(self, time: int) -> list[tuple[float, float, float]] | None:
        """Return the joints' desired positions, velocities and accelerations at a ROS time, or None before the start."""
        now, _, uptime = self._clock
        states = [path.sample(uptime + time - now) for path in self._paths]
        found = [state for state in states if state is not None]
        return found if len(found) == len(states) else None

    def update(self, time: int, period: int, positions: Sequence[float], velocities: Sequence[float]) -> None:
        """Compute one cycle's desired states, and finish goals. A negative period counts as 0."""
        before = self.uptime
        uptime = before + period if period > 0 else before
        self.time, self.uptime = time, uptime
        while self._requests:
            plan, goal = self._requests.popleft()
            if plan is None:
                self._hold(positions, goal, before)
            else:
                self._replace(plan, goal)
        self._clock = (time, period, uptime)

        desired_positions: list[float] = []
        desired_velocities: list[float] = []
        desired_accelerations: list[float] = []
        position_errors: list[float] = []
        velocity_errors: list[float] = []
        active: MonitoredGoal | None = None

        for index, path in enumerate(self._paths):
            if uptime >= path.next_start:
                path.advance(uptime)
            segment = path.current
            elapsed = uptime - segment.start
            if elapsed <= segment.duration:
                x = elapsed / _SECOND
                c0, c1, c2, c3, c4, c5, v1, v2, v3, v4, a1, a2, a3 = segment.coefficients
                position = c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
                velocity = c1 + x * (v1 + x * (v2 + x * (v3 + x * v4)))
                acceleration = v1 + x * (a1 + x * (a2 + x * a3))
            else:
                position, velocity, acceleration = segment.last, 0.0, 0.0
            desired_positions.append(position)
            desired_velocities.append(velocity)
            desired_accelerations.append(acceleration)

            error = position - positions[index]
            if self._continuous[index] and abs(error) < math.inf:
                error = _remainder(error, _turn)
            position_errors.append(error)
            velocity_errors.append(velocity - velocities[index])

            goal = segment.goal
            if goal is not None and goal.outcome is None:
                active = goal
                is_last = path.next_start == NEVER
                self._check(index, segment, is_last, error, velocity_errors[index])

        if active is not None and active.reached == self._all_reached:
            active.finish(_SUCCEEDED)
        self.positions, self.velocities, self.accelerations = (
            desired_positions,
            desired_velocities,
            desired_accelerations,
        )
        self.position_errors, self.velocity_errors = position_errors, velocity_errors

    def times_from_start(self) -> tuple[float, float]:
        """Return the desired and the actual time from the start of the trajectory, in s, as ROS defines them.

        The desired time is that of the last point passed; the actual time adds the time since then. Both are 0 before the first
        point.
        """
        segment = self._paths[0].current
        since = (self.uptime - segment.start) / _SECOND
        return segment.time_from_start / _SECOND, since + segment.time_from_start / _SECOND

    def _check(
        self, index: int, segment: Segment, is_last: bool, position_error: float, velocity_error: float
    ) -> None:
        """Check the tolerances of a joint whose segment belongs to an active goal."""
        goal, tolerances = segment.goal, segment.tolerances
        assert goal is not None
        if self.uptime < segment.end:
            if _is_within(position_error, velocity_error, tolerances.path_position, tolerances.path_velocity):
                return
            code, kind = ErrorCode.PATH_TOLERANCE_VIOLATED, "path"
        elif not is_last:
            return
        elif _is_within(position_error, velocity_error, tolerances.goal_position, tolerances.goal_velocity):
            goal.reached |= 1 << index
            return
        elif self.uptime < segment.end + tolerances.goal_time:
            return
        else:
            code, kind = ErrorCode.GOAL_TOLERANCE_VIOLATED, "goal"
        text = f"{self._names[index]} {kind} error {position_error:.6f}"
        goal.finish(Outcome(GoalEvent.ABORT, (code, text)))

    def _hold(self, positions: Sequence[float], goal: MonitoredGoal | None, before: int = 0) -> None:
        """Replace the trajectory with one that holds all joints. ``before``: uptime of the last desired states."""
        paths = []
        for actual, position, velocity in zip(positions, self.positions, self.velocities, strict=True):
            if self._stop_duration:
                segment = _stop(before, position, velocity, self._stop_duration, goal)
            else:
                here = State(actual if math.isfinite(actual) else position)
                segment = Segment(before, here, before, here, goal)
            paths.append(JointPath([segment], goal=goal))
        self._paths = paths

    def _replace(self, plan: Plan, goal: MonitoredGoal | None) -> None:
        """Keep the current trajectory up to the start of a plan, and follow the plan's points from there."""
        uptime, points = self.uptime, plan.points
        start = uptime + points.stamp - self.time if points.stamp else uptime
        first = max(points.first, points.next_after(uptime - start))
        bridge_start = max(start, uptime)
        bridge_end = start + points.times[first]
        if bridge_end <= uptime:
            bridge_end = uptime + 1  # all points are in the past by now: go to the last one

        paths = []
        for path, column, tolerances, is_continuous in zip(
            self._paths, plan.columns, plan.tolerances, self._continuous, strict=True
        ):
            path.advance(uptime)
            if column is None:
                path.set_goal(goal)
                paths.append(path)
                continue
            allowed = UNCHECKED if goal is None else tolerances
            kept = path.until(bridge_start)
            sampled = kept[-1].sample(bridge_start)
            state = State(*sampled)
            if max(map(abs, sampled)) >= MAX_MAGNITUDE:
                state = State(min(max(state.position, -MAX_MAGNITUDE), MAX_MAGNITUDE), None, None)
            target = points.points[first].positions[column]
            offset = wraparound_offset(state.position, target) if is_continuous else 0.0
            bridge = Segment(
                bridge_start,
                state,
                bridge_end,
                points.points[first].state(column, offset),
                goal,
                allowed,
            )
            tail = Tail(points, column, first, start, offset, allowed)
            paths.append(JointPath([*kept, bridge], tail, goal))
        self._paths = paths


def read_joints(parameters: Parameters, robot: Callable[[], Robot]) -> list[FollowedJoint]:
    """Return the joints listed in the parameter ``joints``, with the tolerances in ``constraints``.

    Raise ControllerError if the parameter is missing or names a joint that the robot's description lacks; raise ValueError
    if a tolerance is not finite.
    """
    names = _read_names(parameters)
    constraints = parameters.below("constraints")
    stopped_velocity = constraints.finite("stopped_velocity_tolerance", 0.01)
    goal_time = int(constraints.finite("goal_time", 0.0) * _SECOND)
    described = robot().joints

    joints = []
    for name in names:
        if name not in described:
            raise ControllerError(f"Could not find joint '{name}' in URDF model.")
        tolerances = JointTolerances(
            path_position=constraints.finite(f"{name}/trajectory", 0.0),
            goal_position=constraints.finite(f"{name}/goal", 0.0),
            goal_velocity=stopped_velocity,
            goal_time=goal_time,
        )
        joints.append(FollowedJoint(name, described[name].type is JointType.CONTINUOUS, tolerances))
    return joints


def _read_names(parameters: Parameters) -> list[str]:
    namespace, value = parameters.namespace, parameters.get("joints")
    if value is None:
        raise ControllerError(f"Could not find 'joints' parameter (namespace: {namespace}).")
    if not isinstance(value, list):
        raise ControllerError(f"The 'joints' parameter is not an array (namespace: {namespace}).")
    names = [name for name in value if isinstance(name, str)]
    if len(names) != len(value):
        raise ControllerError(
            f"The 'joints' parameter contains a non-string element (namespace: {namespace})."
        )
    if not names or len(set(names)) != len(names):
        raise ControllerError(
            f"The 'joints' parameter is empty, or has a joint twice (namespace: {namespace})."
        )
    return names


def _override(default: float, value: float) -> float:
    if value > 0:
        return value
    return 0.0 if value < 0 else default


def _is_within(
    position_error: float, velocity_error: float, max_position: float, max_velocity: float
) -> bool:
    """Return whether both errors are within their limits. A limit that is not above 0 is ignored; NaN exceeds any other limit."""
    return (max_position <= 0.0 or abs(position_error) <= max_position) and (
        max_velocity <= 0.0 or abs(velocity_error) <= max_velocity
    )


def _stop(start: int, position: float, velocity: float, duration: int, goal: MonitoredGoal | None) -> Segment:
    """Return a segment that brings a joint to a stop: the first half of a motion that reverses ``velocity``."""
    first = State(position, velocity)
    turning = Segment(start, first, start + 2 * duration, State(position, -velocity))
    return Segment(start, first, start + duration, State(*turning.sample(start + duration)), goal)
