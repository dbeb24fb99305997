"""The follower of trajectories, cycle by cycle: replacement, holding, stopping, tolerances and outcomes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.control.controller import ControllerError
from minirospy.core.control.goal import CANCELLED, MonitoredGoal, Outcome
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.trajectory import ErrorCode, JointTolerances, Point, TrajectoryError
from minirospy.core.control.trajectory_follower import (
    FollowedJoint,
    GoalTolerance,
    JointsError,
    TrajectoryFollower,
    read_joints,
)
from minirospy.core.graph.goals import GoalEvent
from minirospy.core.urdf.model import Robot
from minirospy.core.urdf.read import parse_robot

SECOND = 1_000_000_000
TICK = SECOND // 100
UNCHECKED = JointTolerances()
BEGIN = 1000 * SECOND  # ROS time at the start
SUCCEEDED = Outcome(GoalEvent.SUCCEED, (ErrorCode.SUCCESSFUL, ""))


class Arm:
    """A follower, and joints that reach what it desires in the next cycle, or are blocked."""

    def __init__(
        self,
        names: str = "ab",
        *,
        continuous: str = "",
        tolerances: JointTolerances = UNCHECKED,
        stop_duration: int = 0,
        allows_partial_goals: bool = False,
        positions: Sequence[float] = (0.0, 0.0),
        velocities: Sequence[float] = (0.0, 0.0),
    ) -> None:
        self.names = list(names)
        self.follower = TrajectoryFollower(
            [FollowedJoint(name, name in continuous, tolerances) for name in names],
            stop_duration,
            allows_partial_goals,
        )
        self.positions = list(positions)
        self.velocities = list(velocities)
        self.blocked = ""
        self.time = BEGIN
        self.follower.start(self.time, self.positions, self.velocities)

    def send(
        self,
        *points: tuple[float, Sequence[float]] | Point,
        names: str = "",
        stamp: float = 0.0,
        tolerances: Sequence[JointTolerances] | None = None,
    ) -> MonitoredGoal:
        """Send a goal; its points are (seconds, positions)."""
        goal = MonitoredGoal()
        made = [
            point if isinstance(point, Point) else Point(round(point[0] * SECOND), point[1])
            for point in points
        ]
        nanoseconds = BEGIN + round(stamp * SECOND) if stamp else 0
        plan = self.follower.plan(list(names) or self.names, made, nanoseconds, tolerances)
        self.follower.request_plan(plan, goal)
        return goal

    def tick(self, count: int = 1, period: int = TICK) -> list[float]:
        """Run cycles; return the positions desired in the last."""
        for _ in range(count):
            self.time += period
            self.follower.update(self.time, period, self.positions, self.velocities)
            for index, name in enumerate(self.names):
                if name not in self.blocked:
                    self.positions[index] = self.follower.positions[index]
                    self.velocities[index] = self.follower.velocities[index]
        return self.follower.positions

    def run(self, seconds: float) -> list[float]:
        return self.tick(round(seconds * SECOND) // TICK)


class TestReplacement:
    def test_joints_are_held_from_the_start(self) -> None:
        arm = Arm(positions=[1.0, -2.0], velocities=[0.5, 0.0])
        assert arm.tick(5) == [1.0, -2.0]
        assert arm.follower.velocities == [0.0, 0.0]

    def test_a_trajectory_starts_in_the_next_cycle(self) -> None:
        arm = Arm()
        arm.tick()
        arm.send((0.1, [1.0, -1.0]))
        desired = [arm.tick()[0] for _ in range(13)]
        assert desired == pytest.approx([0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1, 1])

    def test_joints_may_come_in_any_order(self) -> None:
        arm = Arm("abc", positions=[0.0] * 3, velocities=[0.0] * 3)
        arm.send((0.1, [1.0, 2.0, 3.0]), names="cab")
        assert arm.run(0.2) == [2.0, 3.0, 1.0]

    def test_a_stamp_in_the_future_keeps_the_old_trajectory_until_then(self) -> None:
        arm = Arm()
        arm.send((1.0, [1.0, 1.0]))
        arm.run(0.25)
        arm.send((0.5, [0.0, 0.0]), stamp=0.5)
        # The first cycle, at 0.01 s, was the start of the first trajectory.
        assert arm.run(0.25)[0] == pytest.approx(0.49)
        assert arm.run(0.25)[0] == pytest.approx(0.49 / 2)
        assert arm.run(0.25) == pytest.approx([0.0, 0.0], abs=1e-12)

    def test_a_second_replacement_in_the_future_keeps_the_first(self) -> None:
        arm = Arm()
        arm.tick()
        arm.send((0.1, [1.0, 1.0]), (2.0, [1.0, 1.0]), stamp=0.5)
        arm.send((0.1, [5.0, 5.0]), stamp=1.0)
        assert arm.run(0.48) == [0.0, 0.0]
        assert arm.run(0.3) == [1.0, 1.0]
        assert arm.run(0.21)[0] == pytest.approx(1.0)
        assert arm.run(0.2) == [5.0, 5.0]

    def test_points_in_the_past_are_skipped(self) -> None:
        arm = Arm()
        arm.run(1.0)
        arm.send((0.5, [5.0, 5.0]), (1.5, [1.0, 1.0]), (2.0, [2.0, 2.0]), stamp=0.2)
        assert arm.tick(2)[0] == pytest.approx(0.01 / 0.69)
        assert arm.run(0.68)[0] == pytest.approx(1.0)
        assert arm.run(0.5) == [2.0, 2.0]

    def test_points_that_pass_before_the_next_cycle_are_skipped(self) -> None:
        arm = Arm()
        arm.tick()
        arm.send((0.05, [5.0, 5.0]), (0.3, [1.0, 1.0]), stamp=0.1)
        assert arm.tick(period=SECOND // 5)[0] == 0.0
        assert arm.tick()[0] == pytest.approx(0.01 / 0.19)
        arm.send((0.001, [2.0, 2.0]), stamp=0.25)
        arm.tick(period=SECOND)
        assert arm.tick() == [2.0, 2.0]

    def test_partial_goals_leave_the_other_joints_alone(self) -> None:
        arm = Arm(allows_partial_goals=True)
        first = arm.send((1.0, [1.0, 1.0]))
        arm.run(0.5)
        second = arm.send((0.2, [0.0]), names="b")
        first.finish(CANCELLED)
        arm.run(0.3)
        assert arm.positions[1] == 0.0
        assert second.outcome is None  # the other joint still moves, and belongs to the new goal
        assert arm.run(0.3) == [1.0, 0.0]
        assert second.outcome == SUCCEEDED

    def test_two_partial_goals_between_two_cycles_both_count(self) -> None:
        arm = Arm(allows_partial_goals=True)
        first = arm.send((0.1, [1.0]), names="a")
        second = arm.send((0.1, [2.0]), names="b")
        first.finish(CANCELLED)
        assert arm.run(0.2) == [1.0, 2.0]
        assert (first.outcome, second.outcome) == (CANCELLED, SUCCEEDED)

    @pytest.mark.parametrize("names", ["a", "abc", "ax", "aa", "aab"])
    def test_other_joints_are_refused(self, names: str) -> None:
        arm = Arm()
        with pytest.raises(JointsError) as caught:
            arm.send((1.0, [0.0] * len(names)), names=names)
        assert str(caught.value) == (
            "Cannot create trajectory from message. It does not contain the expected joints."
        )

    @pytest.mark.parametrize("names", ["abc", "x", "aa", "ax"])
    def test_partial_goals_must_have_joints_of_the_controller(self, names: str) -> None:
        arm = Arm(allows_partial_goals=True)
        with pytest.raises(JointsError):
            arm.send((1.0, [0.0] * len(names)), names=names)
        with pytest.raises(JointsError):
            arm.follower.plan([], [Point(SECOND, [])], 0)

    def test_continuous_joints_go_the_shorter_way(self) -> None:
        arm = Arm(continuous="a", positions=[3.0, 3.0])
        arm.send((0.1, [-3.0, -3.0]), (0.2, [-2.0, -2.0]))
        assert arm.run(0.11) == pytest.approx([math.tau - 3.0, -3.0])
        assert arm.run(0.2) == pytest.approx([math.tau - 2.0, -2.0])

    def test_errors_of_continuous_joints_are_the_shorter_way(self) -> None:
        arm = Arm(continuous="a")
        arm.follower.update(BEGIN, TICK, [6.0, 6.0], [0.25, 0.0])
        assert arm.follower.position_errors == pytest.approx([math.tau - 6.0, -6.0])
        assert arm.follower.velocity_errors == [-0.25, 0.0]

    def test_commands_are_not_stored_without_limit_while_the_loop_pauses(self) -> None:
        arm = Arm()
        for position in range(1000):
            arm.send((0.1, [float(position)] * 2))
        assert arm.follower.waiting == 100
        assert arm.run(0.2) == [999.0, 999.0]

    def test_absurd_numbers_never_overflow(self) -> None:
        arm = Arm(continuous="a")
        for cycle in range(300):
            position = 4e99 if cycle % 2 else -4e99
            arm.send(
                Point(1 if cycle % 3 else 2**31 * SECOND, [position] * 2, [-position] * 2, [position] * 2),
                Point(2**31 * SECOND + 1, [-position] * 2, [-position] * 2, [position] * 2),
            )
            arm.tick(period=TICK if cycle % 5 else 2**30 * SECOND)
            follower = arm.follower
            for values in (follower.positions, follower.velocities, follower.accelerations):
                assert all(map(math.isfinite, values))

    def test_a_refused_trajectory_changes_nothing(self) -> None:
        arm = Arm()
        arm.send((1.0, [1.0, 1.0]))
        arm.run(0.5)
        for bad in ([math.nan, 0.0], [0.0], [0.0, math.inf]):
            with pytest.raises(TrajectoryError):
                arm.send((0.1, bad))
        assert arm.run(0.6) == [1.0, 1.0]

    def test_a_period_below_zero_counts_as_zero(self) -> None:
        """ROS time goes back if a simulation is reset or a bag starts again."""
        arm = Arm()
        arm.send((1.0, [1.0, 1.0]))
        before = arm.run(0.5)
        assert arm.tick(period=-500 * SECOND) == before
        assert arm.run(0.5)[0] == pytest.approx(0.99)

    def test_the_time_from_start_is_that_of_the_last_point(self) -> None:
        arm = Arm()
        arm.send((0.5, [1.0, 1.0]), (1.0, [2.0, 2.0]))
        arm.run(0.21)
        assert arm.follower.times_from_start() == pytest.approx((0.0, 0.2))
        arm.run(0.5)
        assert arm.follower.times_from_start() == pytest.approx((0.5, 0.7))


class TestSample:
    def test_it_answers_for_the_past_and_the_future(self) -> None:
        arm = Arm()
        arm.send((1.0, [1.0, 2.0]))
        arm.run(0.51)
        for seconds, position in (
            (0.01, 0.0),
            (0.26, 0.25),
            (0.51, 0.5),
            (1.0, 0.99),
            (1.01, 1.0),
            (9.0, 1.0),
        ):
            states = arm.follower.sample(BEGIN + round(seconds * SECOND))
            assert states is not None
            assert [state[0] for state in states] == pytest.approx([position, 2 * position])
        assert arm.follower.sample(BEGIN - 1) is None


class TestHold:
    def test_without_a_ramp_the_actual_positions_are_held(self) -> None:
        arm = Arm()
        arm.blocked = "b"
        arm.send((1.0, [1.0, 1.0]))
        arm.run(0.5)
        arm.follower.request_hold()
        assert arm.run(0.5) == pytest.approx([0.49, 0.0])
        assert arm.follower.velocities == [0.0, 0.0]

    def test_a_ramp_stops_smoothly_from_the_desired_state(self) -> None:
        arm = Arm(stop_duration=SECOND // 2)
        arm.blocked = "b"
        arm.send((1.0, [1.0, 1.0]))
        arm.run(0.5)
        arm.follower.request_hold()
        before, velocities = arm.follower.positions[1], []
        for _ in range(60):
            position = arm.tick()[1]
            velocities.append(arm.follower.velocities[1])
            assert 0.0 <= position - before <= 0.0101  # no more than one cycle's motion
            before = position
        assert velocities[0] == pytest.approx(1.0, abs=0.01)
        assert velocities[49:] == pytest.approx([0.0] * 11, abs=1e-12)
        assert arm.follower.positions[1] == pytest.approx(
            0.49 + 0.5 * 0.625
        )  # of the quintic to the turning point

    def test_a_goal_without_points_succeeds_at_once_without_a_ramp(self) -> None:
        arm = Arm(tolerances=JointTolerances(goal_position=1e-9))
        goal = MonitoredGoal()
        arm.follower.request_hold(goal)
        arm.tick()
        assert goal.outcome == SUCCEEDED

    def test_a_goal_without_points_succeeds_after_the_ramp(self) -> None:
        arm = Arm(stop_duration=SECOND // 10)
        arm.send((1.0, [1.0, 1.0]))
        arm.run(0.5)
        goal = MonitoredGoal()
        arm.follower.request_hold(goal)
        arm.run(0.09)
        assert goal.outcome is None
        arm.tick()
        assert goal.outcome == SUCCEEDED

    def test_a_position_that_is_not_a_number_is_not_held(self) -> None:
        arm = Arm()
        arm.send((1.0, [1.0, 1.0]))
        arm.run(0.5)
        arm.follower.request_hold()
        arm.positions[0] = math.nan
        assert arm.tick() == pytest.approx([0.49, 0.49])

    def test_a_restart_holds_and_forgets(self) -> None:
        arm = Arm()
        arm.send((1.0, [1.0, 1.0]))
        arm.run(0.5)
        arm.send((1.0, [5.0, 5.0]))
        arm.follower.stop()
        assert not arm.follower.is_running
        arm.follower.start(arm.time, [0.3, 0.2], [0.0, 0.0])
        assert arm.run(0.5) == [0.3, 0.2]


class TestTolerances:
    def test_without_tolerances_a_goal_succeeds_at_its_end(self) -> None:
        arm = Arm()
        arm.blocked = "ab"
        goal = arm.send((0.1, [1.0, 1.0]))
        arm.tick(10)
        assert goal.outcome is None
        arm.tick()
        assert goal.outcome == SUCCEEDED

    def test_a_path_tolerance_aborts_in_the_cycle_that_violates_it(self) -> None:
        arm = Arm(tolerances=JointTolerances(path_position=0.055))
        arm.blocked = "b"
        goal = arm.send((1.0, [1.0, 1.0]))
        arm.tick(6)
        assert goal.outcome is None
        arm.tick()
        assert goal.outcome == Outcome(
            GoalEvent.ABORT, (ErrorCode.PATH_TOLERANCE_VIOLATED, "b path error 0.060000")
        )
        assert arm.run(1.0) == [1.0, 1.0]  # as in ROS, the trajectory goes on

    def test_a_velocity_tolerance_reports_the_position_error(self) -> None:
        arm = Arm(tolerances=JointTolerances(path_velocity=0.5))
        arm.blocked = "a"
        goal = arm.send((1.0, [1.0, 1.0]))
        arm.tick()
        assert goal.outcome == Outcome(
            GoalEvent.ABORT, (ErrorCode.PATH_TOLERANCE_VIOLATED, "a path error 0.000000")
        )

    def test_an_error_that_is_not_a_number_violates_a_tolerance(self) -> None:
        arm = Arm(tolerances=JointTolerances(path_position=0.1))
        goal = arm.send((1.0, [1.0, 1.0]))
        arm.tick()
        arm.positions[0] = math.nan
        assert arm.tick()[0] == pytest.approx(0.01)
        assert goal.outcome is not None
        assert goal.outcome.result[1] == "a path error nan"

    def test_a_goal_tolerance_without_goal_time_is_checked_at_the_end(self) -> None:
        arm = Arm(tolerances=JointTolerances(goal_position=0.05))
        arm.blocked = "a"
        arm.positions = [0.94, 0.0]
        goal = arm.send((0.1, [1.0, 1.0]))
        arm.tick(10)
        assert goal.outcome is None
        arm.tick()
        assert goal.outcome == Outcome(
            GoalEvent.ABORT, (ErrorCode.GOAL_TOLERANCE_VIOLATED, "a goal error 0.060000")
        )

    def test_the_goal_time_is_waited_for_to_the_cycle(self) -> None:
        arm = Arm(tolerances=JointTolerances(goal_position=0.05, goal_time=3 * TICK))
        arm.blocked = "a"
        goal = arm.send((0.1, [1.0, 1.0]))
        arm.tick(13)
        assert goal.outcome is None
        arm.tick()
        assert goal.outcome == Outcome(
            GoalEvent.ABORT, (ErrorCode.GOAL_TOLERANCE_VIOLATED, "a goal error 1.000000")
        )

    def test_a_goal_succeeds_in_the_cycle_in_which_the_last_joint_arrives(self) -> None:
        arm = Arm(tolerances=JointTolerances(goal_position=0.05, goal_velocity=0.01, goal_time=SECOND))
        arm.blocked = "a"
        goal = arm.send((0.1, [1.0, 1.0]))
        arm.run(0.5)
        arm.positions[0], arm.velocities[0] = 0.96, 0.02
        arm.tick()
        assert goal.outcome is None  # too fast
        arm.velocities[0] = 0.01
        arm.tick()
        assert goal.outcome == SUCCEEDED

    def test_a_new_goal_does_not_inherit_arrived_joints(self) -> None:
        arm = Arm(tolerances=JointTolerances(goal_position=0.05, goal_time=SECOND))
        arm.blocked = "b"
        first = arm.send((0.1, [1.0, 1.0]))
        arm.run(0.2)
        assert (first.outcome, first.reached) == (None, 1)
        first.finish(CANCELLED)
        arm.blocked = "a"
        second = arm.send((0.1, [2.0, 2.0]))
        arm.run(0.2)
        assert (second.outcome, second.reached) == (None, 2)

    def test_a_preempted_goal_is_not_checked(self) -> None:
        arm = Arm(tolerances=JointTolerances(path_position=0.01))
        goal = arm.send((1.0, [1.0, 1.0]))
        arm.tick()
        goal.finish(CANCELLED)
        arm.blocked = "ab"
        arm.run(2.0)
        assert goal.outcome == CANCELLED

    def test_tolerances_are_not_checked_before_a_future_start(self) -> None:
        arm = Arm(tolerances=JointTolerances(path_position=0.01, goal_position=0.01))
        arm.positions = [5.0, 5.0]
        arm.blocked = "ab"
        goal = arm.send((0.5, [1.0, 1.0]), stamp=0.5)
        arm.run(0.49)
        assert goal.outcome is None
        arm.run(0.1)
        assert goal.outcome is not None
        assert goal.outcome.result[0] == ErrorCode.PATH_TOLERANCE_VIOLATED

    def test_a_joint_that_moves_by_a_command_is_not_checked_by_a_partial_goal(self) -> None:
        arm = Arm(tolerances=JointTolerances(path_position=0.2), allows_partial_goals=True)
        arm.blocked = "a"
        arm.follower.request_plan(arm.follower.plan(["a"], [Point(SECOND, [1.0])], 0), None)
        arm.run(0.5)
        goal = arm.send((0.1, [1.0]), names="b")
        arm.run(0.6)
        assert goal.outcome == SUCCEEDED

    def test_a_goal_overrides_tolerances(self) -> None:
        default = JointTolerances(0.1, 0.2, 0.3, 0.4, 5)
        arm = Arm(tolerances=default)
        tolerances = arm.follower.goal_tolerances(
            [GoalTolerance("b", 1.0, -1.0), GoalTolerance("other", 7.0, 7.0)],
            [GoalTolerance("a", -1.0, 2.0)],
            0,
        )
        assert tolerances == [JointTolerances(0.1, 0.2, 0.0, 2.0, 5), JointTolerances(1.0, 0.0, 0.3, 0.4, 5)]
        for given_time, used in ((7, 7), (-1, 0)):
            assert arm.follower.goal_tolerances([], [], given_time)[0].goal_time == used
        nan = arm.follower.goal_tolerances([GoalTolerance("a", math.nan, math.nan)], [], 0)
        assert nan == [default, default]

    def test_the_tolerances_of_a_goal_are_used(self) -> None:
        arm = Arm()
        arm.blocked = "a"
        tolerances = arm.follower.goal_tolerances([], [GoalTolerance("a", 0.5, 0.0)], TICK)
        goal = arm.send((0.1, [1.0, 1.0]), tolerances=tolerances)
        arm.run(0.2)
        assert goal.outcome == Outcome(
            GoalEvent.ABORT, (ErrorCode.GOAL_TOLERANCE_VIOLATED, "a goal error 1.000000")
        )


POSITIONS = st.floats(-3, 3)
SPEEDS = st.floats(-1, 1)
POINTS = st.lists(st.tuples(st.integers(5, 300), POSITIONS, SPEEDS, SPEEDS), min_size=1, max_size=4)


def make_points(drawn: list[tuple[int, float, float, float]], kind: int) -> list[Point]:
    """Return points whose times, in cycles, add up. ``kind``: the number of values that a point has for a joint."""
    time, points = 0, []
    for cycles, *values in drawn:
        time += cycles * TICK
        points.append(Point(time, *[[value, -value] for value in values[:kind]]))
    return points


@given(
    POINTS,
    POINTS,
    st.sampled_from([1, 2, 3]),
    st.sampled_from([1, 2, 3]),
    st.integers(0, 600),
    st.integers(0, 3),
    st.sampled_from(["", "a", "ab"]),
    st.integers(0, 40),
)
def test_preemption_never_jumps(
    first: list[tuple[int, float, float, float]],
    second: list[tuple[int, float, float, float]],
    first_kind: int,
    second_kind: int,
    cycles: int,
    late: int,
    continuous: str,
    delay: int,
) -> None:
    """At any time, in the present or future, a cycle moves a joint by what its speed in this cycle allows.

    ``late``: cycles that pass between the check of the message and its use.
    """
    arm, unchanged = Arm(continuous=continuous), Arm(continuous=continuous)
    for each in (arm, unchanged):
        each.send(*make_points(first, first_kind))
        each.tick(cycles + 1)
    stamp = arm.time + delay * TICK if delay else 0
    plan = arm.follower.plan(arm.names, make_points(second, second_kind), stamp)
    for each in (arm, unchanged):
        each.tick(late)
    arm.follower.request_plan(plan, None)

    start = max(stamp, arm.time + TICK)
    before = arm.follower.positions
    for _ in range(delay + 200):
        arm.tick()
        unchanged.tick()
        if arm.time <= start:
            assert arm.follower.positions == pytest.approx(unchanged.follower.positions, abs=1e-9)
        if arm.time < start or (arm.time == start and second_kind == 3):
            assert arm.follower.velocities == pytest.approx(unchanged.follower.velocities, abs=1e-9)

        for index in range(2):
            step = abs(arm.follower.positions[index] - before[index])
            if step <= abs(arm.follower.velocities[index]) * TICK / SECOND * 1.1 + 1e-9:
                continue  # the speed at the end of the cycle is high enough
            samples = [arm.follower.sample(arm.time - TICK * part // 20) for part in range(21)]
            speeds = [abs(states[index][1]) for states in samples if states]
            assert step <= max(speeds) * TICK / SECOND * 1.1 + 1e-9
        before = arm.follower.positions


@given(POINTS, st.sampled_from([1, 2, 3]), st.integers(0, 600), st.integers(1, 50))
def test_a_smooth_stop_never_jumps(
    drawn: list[tuple[int, float, float, float]], kind: int, cycles: int, ramp: int
) -> None:
    arm = Arm(stop_duration=ramp * TICK)
    arm.send(*make_points(drawn, kind))
    arm.tick(cycles + 1)
    speed = [abs(value) for value in arm.follower.velocities]
    before = list(arm.follower.positions)
    arm.follower.request_hold()
    for _ in range(ramp + 2):
        arm.tick()
        for index in range(2):
            step = abs(arm.follower.positions[index] - before[index])
            assert step <= speed[index] * TICK / SECOND * (1 + 1e-9) + 1e-12
        before = list(arm.follower.positions)
    assert arm.follower.velocities == [0.0, 0.0]


@given(POINTS, POINTS, st.integers(0, 600))
def test_lines_stay_in_the_range_of_the_points(
    first: list[tuple[int, float, float, float]], second: list[tuple[int, float, float, float]], cycles: int
) -> None:
    """Trajectories of positions only, also replaced ones, obey every limit that their points obey."""
    arm = Arm()
    arm.send(*make_points(first, 1))
    limit = max(abs(point[1]) for point in (*first, *second))
    for _ in range(cycles + 1):
        assert all(abs(position) <= limit + 1e-12 for position in arm.tick())
    arm.send(*make_points(second, 1))
    for _ in range(400):
        assert all(abs(position) <= limit + 1e-12 for position in arm.tick())


class TestReadJoints:
    robot_text = (
        "<robot name='r'><link name='l'/><link name='m'/><link name='n'/>"
        "<joint name='a' type='continuous'><parent link='l'/><child link='m'/></joint>"
        "<joint name='b' type='prismatic'><parent link='m'/><child link='n'/><mimic joint='a'/>"
        "<limit lower='0' upper='1' effort='1' velocity='1'/></joint></robot>"
    )

    def read(self, values: dict[str, Any]) -> list[FollowedJoint]:
        return read_joints(Parameters("/arm/traj", values), self.robot)

    def robot(self) -> Robot:
        return parse_robot(self.robot_text)

    def test_the_defaults_are_those_of_ros(self) -> None:
        """A joint that mimics another one is a joint like the others, as in ROS."""
        usual = JointTolerances(goal_velocity=0.01)
        assert self.read({"joints": ["b", "a"]}) == [
            FollowedJoint("b", False, usual),
            FollowedJoint("a", True, usual),
        ]

    def test_constraints_are_read(self) -> None:
        constraints = {
            "goal_time": 0.5,
            "stopped_velocity_tolerance": 0,
            "a": {"trajectory": 0.1, "goal": 0.2},
            "b": {"goal": 3},
        }
        assert self.read({"joints": ["a", "b"], "constraints": constraints}) == [
            FollowedJoint("a", True, JointTolerances(0.1, 0.0, 0.2, 0.0, SECOND // 2)),
            FollowedJoint("b", False, JointTolerances(0.0, 0.0, 3.0, 0.0, SECOND // 2)),
        ]

    @pytest.mark.parametrize(
        ("values", "text"),
        [
            ({}, "Could not find 'joints' parameter (namespace: /arm/traj)."),
            ({"joints": "a"}, "The 'joints' parameter is not an array (namespace: /arm/traj)."),
            (
                {"joints": ["a", 1]},
                "The 'joints' parameter contains a non-string element (namespace: /arm/traj).",
            ),
            ({"joints": []}, "The 'joints' parameter is empty, or has a joint twice (namespace: /arm/traj)."),
            (
                {"joints": ["a", "a"]},
                "The 'joints' parameter is empty, or has a joint twice (namespace: /arm/traj).",
            ),
            ({"joints": ["a", "z"]}, "Could not find joint 'z' in URDF model."),
        ],
    )
    def test_wrong_joints_are_refused_with_texts_of_ros(self, values: dict[str, Any], text: str) -> None:
        with pytest.raises(ControllerError) as caught:
            self.read(values)
        assert str(caught.value) == text

    @pytest.mark.parametrize("constraints", [{"goal_time": math.nan}, {"a": {"goal": math.inf}}])
    def test_tolerances_must_be_finite(self, constraints: dict[str, Any]) -> None:
        with pytest.raises(ValueError, match="must be a finite number"):
            self.read({"joints": ["a"], "constraints": constraints})
