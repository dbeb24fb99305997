"""The way to a target: within limits, and the shorter one of a joint that turns; compared with angles' functions."""

from __future__ import annotations

import math

import angles
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.control.hardware import Joint
from minirospy.core.control.pid import Pid
from minirospy.core.control.position_loop import PositionLoop
from minirospy.core.urdf.model import Joint as UrdfJoint
from minirospy.core.urdf.model import JointType, Limit, Origin


def loop(kind: JointType, position: float, lower: float = -1.0, upper: float = 2.0) -> PositionLoop:
    """Return the loop of a joint at a position."""
    described = UrdfJoint("j", kind, "a", "b", Origin(), (0.0, 0.0, 1.0), 1, Limit(lower, upper, 10.0, 1.0))
    return PositionLoop(Joint("j", position=position), described, Pid(2.0))


def test_targets_are_cut_to_the_limits_of_the_joint() -> None:
    for kind in (JointType.REVOLUTE, JointType.PRISMATIC):
        assert [loop(kind, 0.0).clamp(each) for each in (-5.0, 0.5, 5.0)] == [-1.0, 0.5, 2.0]
    assert loop(JointType.CONTINUOUS, 0.0).clamp(50.0) == 50.0


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_a_continuous_joint_goes_the_shorter_way(position: float, target: float) -> None:
    error = loop(JointType.CONTINUOUS, position).error(target)
    assert abs(error) <= math.pi
    expected = angles.shortest_angular_distance(position, target)
    assert math.remainder(error - expected, math.tau) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-6.0, 5.0), st.floats(-6.0, 5.0))
def test_a_revolute_joint_stays_within_its_limits(position: float, target: float) -> None:
    error = loop(JointType.REVOLUTE, position, -6.0, 5.0).error(target)
    assert -6.0 <= position + error <= 5.0 or abs(position + error - target) < 1e-9
    _, expected = angles.shortest_angular_distance_with_large_limits(position, target, -6.0, 5.0)
    assert math.remainder(error - expected, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_revolute_joint_takes_the_longer_way_if_the_shorter_one_leaves_its_limits() -> None:
    assert loop(JointType.REVOLUTE, 3.0, -3.1, 3.1).error(-3.0) == pytest.approx(-6.0)
    assert loop(JointType.CONTINUOUS, 3.0).error(-3.0) == pytest.approx(math.tau - 6.0)


def test_a_prismatic_joint_goes_straight() -> None:
    assert loop(JointType.PRISMATIC, 0.0, -9.0, 9.0).error(8.0) == 8.0


def test_a_position_that_is_not_a_number_gives_an_error_that_pid_ignores() -> None:
    for kind in (JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC):
        joint = loop(kind, math.nan)
        assert joint.pid.compute(joint.error(0.5), None, 0.1) == 0.0
        joint.joint.position = math.inf
        assert joint.pid.compute(joint.error(0.5), None, 0.1) == 0.0
