"""A gripper's goals: reached, stalled, and held."""

from __future__ import annotations

import pytest

from minirospy.core.control.goal import MonitoredGoal, Outcome
from minirospy.core.control.gripper import Gripper, GripperCommand, GripperLimits
from minirospy.core.graph.goals import GoalEvent

SECOND = 1_000_000_000


@pytest.fixture
def gripper() -> Gripper:
    gripper = Gripper(GripperLimits(max_effort=7.0))
    gripper.hold(0.25)
    return gripper


def send(gripper: Gripper, position: float, time: int = 0) -> MonitoredGoal:
    goal = MonitoredGoal()
    gripper.command = GripperCommand(position, 5.0, goal, time)
    return goal


def test_it_holds_with_the_effort_of_the_parameter(gripper: Gripper) -> None:
    assert gripper.check(0, 0.0, 0.0, 0.0) == GripperCommand(0.25, 7.0)


def test_a_goal_is_reached_within_its_tolerance(gripper: Gripper) -> None:
    goal = send(gripper, 0.5)
    gripper.check(0, 0.4899, 1.0, 3.0)
    assert goal.outcome is None
    assert gripper.check(1, 0.4901, 1.0, 3.0) == (0.5, 5.0, goal, 0)
    assert goal.outcome == Outcome(GoalEvent.SUCCEED, (0.4901, 3.0, False, True))
    assert gripper.check(2, 0.0, 0.0, 3.0).position == 0.5  # held
    assert goal.outcome.event is GoalEvent.SUCCEED


def test_a_gripper_that_does_not_move_is_stalled_after_the_timeout(gripper: Gripper) -> None:
    gripper.check(0, 0.0, 0.0, 0.0)
    goal = send(gripper, 0.5, 8 * SECOND)
    gripper.check(9 * SECOND, 0.1, 0.0, 3.0)
    assert goal.outcome is None
    gripper.check(9 * SECOND + SECOND // 2, 0.2, -0.0011, 3.0)
    gripper.check(10 * SECOND + SECOND // 2, 0.2, 0.001, 3.0)
    assert goal.outcome is None
    gripper.check(10 * SECOND + SECOND // 2 + 1, 0.2, 0.0, 4.0)
    assert goal.outcome == Outcome(GoalEvent.ABORT, (0.2, 4.0, True, False))


def test_a_new_goal_gets_its_own_timeout(gripper: Gripper) -> None:
    send(gripper, 0.5)
    gripper.check(0, 0.2, 0.0, 3.0)
    goal = send(gripper, 0.6, SECOND)
    gripper.check(SECOND + 1, 0.2, 0.0, 3.0)
    assert goal.outcome is None
    gripper.check(2 * SECOND + 2, 0.2, 0.0, 3.0)
    assert goal.outcome is not None


def test_the_timeout_starts_again_if_time_goes_back(gripper: Gripper) -> None:
    goal = send(gripper, 0.5, 9 * SECOND)
    for time in (9 * SECOND, SECOND, 2 * SECOND):
        gripper.check(time, 0.2, 0.0, 3.0)
    assert goal.outcome is None
    gripper.check(2 * SECOND + 1, 0.2, 0.0, 3.0)
    assert goal.outcome is not None
