"""The gripper, compared cycle by cycle with ROS's GripperActionController (make_recorded_grippers.py)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from minirospy.core.control.goal import CANCELLED, MonitoredGoal
from minirospy.core.control.gripper import Gripper, GripperCommand, GripperLimits
from minirospy.core.control.pid import Pid
from minirospy.core.graph.goals import GoalEvent

RUNS: list[dict[str, Any]] = json.loads(
    (Path(__file__).parent / "recorded_grippers.json").read_text(encoding="utf-8")
)
SECOND = 1_000_000_000
TICK = SECOND // 100
REJECTED = 5
STATES = {GoalEvent.CANCEL: 2, GoalEvent.SUCCEED: 3, GoalEvent.ABORT: 4}


@pytest.mark.parametrize("number", range(len(RUNS)))
def test_commands_and_outcomes_are_those_of_ros(number: int) -> None:
    recorded = RUNS[number]
    limits = GripperLimits(
        abs(recorded["goal_tolerance"]),
        abs(recorded["max_effort"]),
        recorded["stall_velocity_threshold"],
        round(recorded["stall_timeout"] * SECOND),
    )
    gripper, pid = Gripper(limits), Pid(p=100.0, d=10.0)
    gripper.hold(recorded["start"])
    events = {tick: event for tick, *event in recorded["events"]}
    goals: list[MonitoredGoal] = []
    outcomes: list[list[float]] = []
    is_running, effort, commanded = True, 0.0, 0.0
    reported: set[int] = set()

    for tick, (position, velocity, right) in enumerate(recorded["cycles"], 1):
        before = recorded["cycles"][max(tick - 2, 0)]
        time, kind, *values = events.get(tick, (0, ""))
        if kind == "goal":
            goals.append(MonitoredGoal())
            if is_running:
                if len(goals) > 1:
                    goals[-2].finish(CANCELLED)
                gripper.command = GripperCommand(*values, goals[-1], time)
            else:
                outcomes.append([tick, len(goals) - 1, REJECTED, 0, 0, 0, 0])
                reported.add(len(goals) - 1)
        elif kind == "cancel":
            if goals[-1].outcome is None and len(goals) - 1 not in reported:
                gripper.hold(position)
                goals[-1].finish(CANCELLED)
        elif kind == "stop":
            is_running = False
            for goal in goals:
                goal.finish(CANCELLED)
        elif kind == "start":
            gripper.hold(position)
            is_running, commanded = True, 0.0 if recorded["kind"] == "effort" else before[2]

        if is_running:
            command = gripper.check(100 * SECOND + tick * TICK, position, velocity, effort)
            commanded, effort = command.position, command.max_effort
            if recorded["kind"] == "effort":
                limit = abs(command.max_effort)
                force = pid.compute(command.position - position, -velocity, 0.01)
                commanded = effort = min(max(force, -limit), limit)
        assert commanded == pytest.approx(right, abs=1e-6)
        for index, goal in enumerate(goals):
            if goal.outcome and index not in reported:
                reported.add(index)
                result = goal.outcome.result or (0, 0, False, False)
                outcomes.append([tick, index, STATES[goal.outcome.event], *map(float, result)])

    assert len(outcomes) == len(recorded["outcomes"])
    for found, expected in zip(outcomes, recorded["outcomes"], strict=True):
        assert found == pytest.approx(expected, abs=1e-6)
