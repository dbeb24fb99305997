"""Poses of joints compared with numpy matrices, and the graph of a robot."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.urdf.describe import dot_graph
from minirospy.core.urdf.model import Joint, JointType, Origin
from minirospy.core.urdf.poses import (
    Segment,
    matrix_from_quaternion,
    quaternion_from_matrix,
    quaternion_from_rpy,
    rpy_from_quaternion,
)
from minirospy.core.urdf.read import read_robot

ANGLES = st.floats(-math.pi, math.pi)
HERE = Path(__file__).parent


def turn(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """Return the matrix of a rotation about a unit axis, by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


@given(ANGLES, ANGLES, ANGLES)
def test_rpy_turns_about_fixed_axes(roll: float, pitch: float, yaw: float) -> None:
    expected = turn((0, 0, 1), yaw) @ turn((0, 1, 0), pitch) @ turn((1, 0, 0), roll)
    matrix = matrix_from_quaternion(quaternion_from_rpy(roll, pitch, yaw))
    np.testing.assert_allclose(np.reshape(matrix, (3, 3)), expected, atol=1e-12)


@given(ANGLES, st.floats(-1.5, 1.5), ANGLES)
def test_rpy_comes_back(roll: float, pitch: float, yaw: float) -> None:
    rotation = quaternion_from_rpy(roll, pitch, yaw)
    again = quaternion_from_rpy(*rpy_from_quaternion(rotation))
    assert abs(sum(a * b for a, b in zip(rotation, again, strict=True))) == pytest.approx(1, abs=1e-12)


@given(ANGLES, ANGLES, ANGLES)
def test_quaternion_comes_back_from_matrix(roll: float, pitch: float, yaw: float) -> None:
    rotation = quaternion_from_rpy(roll, pitch, yaw)
    again = quaternion_from_matrix(matrix_from_quaternion(rotation))
    assert abs(sum(a * b for a, b in zip(rotation, again, strict=True))) == pytest.approx(1, abs=1e-12)


def test_poles_have_no_roll() -> None:
    assert rpy_from_quaternion(quaternion_from_rpy(0, math.pi / 2, 0)) == (0, math.pi / 2, 0)
    roll, pitch, yaw = rpy_from_quaternion(quaternion_from_rpy(0.5, -math.pi / 2, 0.25))
    assert (roll, pitch) == (0, -math.pi / 2)
    assert yaw == pytest.approx(0.75)


def joint(type_: JointType, axis: tuple[float, float, float]) -> Joint:
    return Joint("j", type_, "a", "b", Origin((1, 2, 3), (0.1, 0.2, 0.3)), axis, 1)


@given(ANGLES)
def test_turning_joint_turns_about_its_axis(angle: float) -> None:
    segment = Segment(joint(JointType.CONTINUOUS, (0, 3, 4)))
    pose = segment.pose(angle)
    origin = np.reshape(matrix_from_quaternion(quaternion_from_rpy(0.1, 0.2, 0.3)), (3, 3))
    np.testing.assert_allclose(
        np.reshape(matrix_from_quaternion(pose.rotation), (3, 3)),
        origin @ turn((0, 0.6, 0.8), angle),
        atol=1e-12,
    )
    assert pose.translation == (1, 2, 3)


def test_sliding_joint_moves_along_its_axis() -> None:
    segment = Segment(joint(JointType.PRISMATIC, (0, 2, 0)))
    origin = np.reshape(matrix_from_quaternion(quaternion_from_rpy(0.1, 0.2, 0.3)), (3, 3))
    np.testing.assert_allclose(
        segment.pose(0.5).translation, np.array([1, 2, 3]) + origin[:, 1] * 0.5, atol=1e-12
    )


@pytest.mark.parametrize("type_", [JointType.FIXED, JointType.PLANAR, JointType.FLOATING])
def test_other_joints_do_not_move(type_: JointType) -> None:
    segment = Segment(joint(type_, (1, 0, 0)))
    assert not segment.is_moving
    assert segment.pose(1.0) == segment.pose(0.0)


def test_axis_without_direction_is_x() -> None:
    assert Segment(joint(JointType.PRISMATIC, (0, 0, 0))).pose(1).translation[0] > 1.9


def test_graph_is_that_of_urdf_to_graphviz() -> None:
    robot = read_robot(HERE / "arm.urdf")
    assert dot_graph(robot) == (HERE / "arm.gv").read_text(encoding="utf-8")
