"""The conversion of joint positions to link poses."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from minirospy.core.urdf.read import parse_robot, read_robot
from minirospy.ros.robot_state_publisher.frames import RobotFrames, prefixed

ARM = read_robot(Path(__file__).parents[2] / "core" / "urdf" / "arm.urdf")


def joint(name: str, type_: str, parent: str, child: str, inside: str = "") -> str:
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    return f'<joint name="{name}" type="{type_}"><parent link="{parent}"/><child link="{child}"/>{limit}{inside}</joint>'


def frames_of(*joints: str) -> RobotFrames:
    links = "".join(f'<link name="{name}"/>' for name in "abcdef"[: len(joints) + 1])
    return RobotFrames(parse_robot(f'<robot name="r">{links}{"".join(joints)}</robot>'))


def test_moving_joints_come_in_the_order_of_their_names() -> None:
    # These values are recorded from Debian's robot_state_publisher.
    moving = [*RobotFrames(ARM).moving({"shoulder": 0.5, "elbow": 1.0, "left": 0.02})]
    assert [each.child for each in moving] == ["forearm", "finger_left", "finger_right", "upper_arm"]
    assert moving[0].pose.rotation == pytest.approx(
        (0.0, 0.428811237787379, 0.2144056188936895, 0.8775825618903728), abs=1e-12
    )
    assert moving[3].pose.rotation == pytest.approx(
        (-0.0023149221230548407, 0.34600864090831934, 0.14758759504425828, 0.9265476584296105), abs=1e-12
    )


def test_mimicking_joint_follows() -> None:
    moving = {each.child: each.pose for each in RobotFrames(ARM).moving({"left": 0.02})}
    assert moving["finger_right"].translation == pytest.approx((-0.14, 0, 0))


def test_published_position_of_a_mimicking_joint_counts() -> None:
    moving = {each.child: each.pose for each in RobotFrames(ARM).moving({"left": 0.02, "right": 0.5})}
    assert moving["finger_right"].translation == pytest.approx((-0.5, 0, 0))


def test_mimics_of_mimics_follow_in_any_order() -> None:
    frames = frames_of(
        joint("x", "prismatic", "a", "b", '<mimic joint="y" multiplier="2"/>'),
        joint("y", "prismatic", "b", "c", '<mimic joint="z" offset="1"/>'),
        joint("z", "prismatic", "c", "d"),
    )
    positions = {each.child: each.pose.translation[0] for each in frames.moving({"z": 0.5})}
    assert positions == {"b": 3.0, "c": 1.5, "d": 0.5}


def test_mimics_in_a_circle_do_not_hang() -> None:
    frames = frames_of(
        joint("x", "prismatic", "a", "b", '<mimic joint="y"/>'),
        joint("y", "prismatic", "b", "c", '<mimic joint="x"/>'),
    )
    assert [*frames.moving({})] == []


def test_fixed_and_planar_joints_are_fixed_and_floating_ones_left_out() -> None:
    frames = frames_of(
        joint("x", "fixed", "a", "b"), joint("y", "planar", "b", "c"), joint("z", "floating", "c", "d")
    )
    assert [(each.parent, each.child) for each in frames.fixed()] == [("a", "b"), ("b", "c")]


@pytest.mark.parametrize("position", [math.nan, math.inf, -math.inf])
def test_position_that_is_not_a_number_is_not_hidden(position: float) -> None:
    assert all(math.isnan(part) for part in next(RobotFrames(ARM).moving({"elbow": position})).pose.rotation)


@pytest.mark.parametrize(
    ("prefix", "frame", "expected"),
    [
        ("", "base", "base"),
        ("rob", "base", "rob/base"),
        ("/rob", "base", "rob/base"),
        ("/rob/", "base", "rob//base"),
        ("rob", "/base", "base"),
    ],
)
def test_prefix_is_set_as_in_ros(prefix: str, frame: str, expected: str) -> None:
    assert prefixed(prefix, frame) == expected


def test_unknown_joints_are_named() -> None:
    assert RobotFrames(ARM).unknown({"shoulder": 0, "wrist": 0, "foo": 0}) == ["foo"]
