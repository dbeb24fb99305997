"""The follower, compared cycle by cycle with ROS's JointTrajectoryController (make_recorded_trajectories.py)."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from minirospy.core.control.goal import CANCELLED, MonitoredGoal
from minirospy.core.control.trajectory import ErrorCode, JointTolerances, Point, TrajectoryError
from minirospy.core.control.trajectory_follower import (
    FollowedJoint,
    GoalTolerance,
    JointsError,
    TrajectoryFollower,
)
from minirospy.core.graph.goals import GoalEvent

RUNS: list[dict[str, Any]] = json.loads(
    (Path(__file__).parent / "recorded_trajectories.json").read_text(encoding="utf-8")
)
SECOND = 1_000_000_000
TICK = SECOND // 100
CYCLES = 220
RECORDED_EVERY = 10  # cycles
PREEMPTED, SUCCEEDED, ABORTED, REJECTED = 2, 3, 4, 5
STATES = {GoalEvent.CANCEL: PREEMPTED, GoalEvent.SUCCEED: SUCCEEDED, GoalEvent.ABORT: ABORTED}


class Run:
    """A controller's follower that gets the recorded messages, and its goals in the order of their arrival."""

    def __init__(self, recorded: dict[str, Any]) -> None:
        tolerances = JointTolerances(
            path_position=recorded["path"],
            goal_position=recorded["goal"],
            goal_velocity=recorded["velocity"],
            goal_time=round(recorded["goal_time"] * SECOND),
        )
        joints = [
            FollowedJoint(name, bool(is_continuous), tolerances)
            for name, is_continuous in zip("ab", recorded["continuous"], strict=True)
        ]
        self.follower = TrajectoryFollower(
            joints, round(recorded["stop"] * SECOND), bool(recorded["partial"])
        )
        self.goals: list[MonitoredGoal] = []
        self.active: MonitoredGoal | None = None
        self.outcomes: list[list[Any]] = []

    def report(self, tick: int) -> None:
        """Add the outcome of the active goal, if it has one."""
        goal = self.active
        if goal is not None and goal.outcome is not None:
            event, result = goal.outcome
            code, text = result or (ErrorCode.SUCCESSFUL, "")
            self.outcomes.append([tick, self.goals.index(goal), STATES[event], code, text])
            self.active = None

    def receive(self, event: dict[str, Any]) -> None:
        """Do what the controller's shell does with a message."""
        tick = event["tick"]
        if event["kind"] == "cancel":
            if self.active is not None:
                self.follower.request_hold()
                self.active.finish(CANCELLED)
                self.report(tick)
            return
        if event["kind"] == "query":
            states = self.follower.sample(event["time"]) or []
            for values, right in zip(zip(*states, strict=True), event["state"], strict=True):
                assert values == pytest.approx(right, rel=1e-6, abs=1e-4)
            return

        goal = MonitoredGoal() if event["kind"] == "goal" else None
        if goal:
            self.goals.append(goal)
        points = [Point(*values) for values in event["points"]]
        names = list(event["names"])
        tolerances = None
        try:
            if goal:
                self.follower.columns(names)
                path, end = ([GoalTolerance(*each) for each in event[kind]] for kind in ("path", "goal"))
                tolerances = self.follower.goal_tolerances(path, end, event["goal_time"])
            if points:
                plan = self.follower.plan(names, points, event["stamp"], tolerances)
                self.follower.request_plan(plan, goal)
            else:
                self.follower.request_hold(goal)
        except TrajectoryError as error:
            if goal:
                refusal = (ErrorCode.INVALID_GOAL, str(error))
                if isinstance(error, JointsError):
                    refusal = (ErrorCode.INVALID_JOINTS, "")
                self.outcomes.append([tick, len(self.goals) - 1, REJECTED, *refusal])
            return
        if self.active is not None:
            self.active.finish(CANCELLED)
            self.report(tick)
        self.active = goal


@pytest.mark.parametrize("number", range(len(RUNS)))
def test_commands_and_outcomes_are_those_of_ros(number: int) -> None:
    recorded = RUNS[number]
    run = Run(recorded)
    events = {event["tick"]: event for event in recorded["events"]}
    positions, velocities, time = list(recorded["start"]), [0.0, 0.0], 100 * SECOND
    run.follower.start(time, positions, velocities)
    commands: list[float] = []
    states: list[float] = []

    for tick in range(1, CYCLES + 1):
        if tick in events:
            run.receive(events[tick])
        time += TICK
        run.follower.update(time, TICK, positions, velocities)
        run.report(tick)
        if tick % RECORDED_EVERY == 0:
            commands += run.follower.positions
            states += run.follower.times_from_start()
            states += run.follower.accelerations
            states += run.follower.velocity_errors
        before, positions = positions, [position * 0.99 for position in run.follower.positions]
        velocities = [(now - then) * 100.0 for now, then in zip(positions, before, strict=True)]

    found, expected = sorted(run.outcomes), sorted(recorded["outcomes"])
    assert [outcome[:4] for outcome in found] == [outcome[:4] for outcome in expected]
    for (*_, text), (*_, right) in zip(found, expected, strict=True):
        if " error " not in text:
            assert text == right
            continue
        # ROS takes errors of more than half a turn for smaller ones, also of joints that cannot turn so far.
        (words, error), (right_words, right_error) = (each.rsplit(" ", 1) for each in (text, right))
        assert words == right_words
        assert math.remainder(float(error), math.tau) == pytest.approx(float(right_error), abs=2e-6)
    assert commands == pytest.approx(recorded["commands"], abs=1e-6)
    assert states == pytest.approx(recorded["states"], rel=1e-6, abs=1e-4)
