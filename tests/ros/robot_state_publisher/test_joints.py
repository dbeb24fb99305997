"""The joints in a description that can be set, and the joint states published for them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from minirospy.ros.robot_state_publisher.joints import (
    Dependent,
    FreeJoint,
    JointError,
    JointOptions,
    JointStates,
    read_joints,
)

ARM = (Path(__file__).parents[2] / "core" / "urdf" / "arm.urdf").read_text(encoding="utf-8")


def joints_of(text: str = ARM, **options: object) -> JointStates:
    warnings: list[str] = []
    joints = read_joints(text, JointOptions(**options), warnings.append)  # type: ignore[arg-type]
    assert not warnings
    return joints


def joint(name: str, inside: str, kind: str = "revolute") -> str:
    return f'<joint name="{name}" type="{kind}"><limit lower="-1" upper="2"/>{inside}</joint>'


def mimic(name: str, of: str) -> str:
    return joint(name, f"<mimic joint='{of}'/>")


def test_zero_moves_to_the_middle_if_out_of_limits() -> None:
    values = joints_of().values()
    assert values.name == ["shoulder", "elbow", "left", "right"]
    assert values.position == pytest.approx([0, 0, 0.03, 0.16])
    assert (values.velocity, values.effort) == ([], [])


def test_parameters_select_the_published_messages() -> None:
    values = joints_of(
        zero={"elbow": 1.0}.get,
        use_mimic_tags=False,
        publish_default_positions=False,
        publish_default_velocities=True,
        publish_default_efforts=True,
    ).values()
    assert values.position == []
    assert (values.velocity, values.effort) == ([0.0] * 4, [0.0] * 4)
    assert joints_of(zero={"elbow": 1.0}.get).values().position[1] == 1.0
    assert joints_of(use_mimic_tags=False).values().position[3] == 0.0


def test_smallest_limits_are_used() -> None:
    safety = "<safety_controller soft_lower_limit='-0.5' soft_upper_limit='5'/>"
    text = f"<robot>{joint('j', safety)}</robot>"
    assert (joints_of(text).free["j"].lower, joints_of(text).free["j"].upper) == (-0.5, 2)
    assert joints_of(text, use_smallest_joint_limits=False).free["j"].lower == -1


def test_dependent_joints_follow_through_a_chain() -> None:
    text = f"<robot>{joint('a', '')}{joint('b', '')}{joint('c', '')}</robot>"
    rules = {"a": Dependent("b", 2, 0.5), "b": Dependent("c", 3, 1)}
    joints = joints_of(text, dependent_joints=rules)
    joints.update(["c"], [0.1], [1.0], [7.0])
    values = joints.values()
    assert values.position == pytest.approx([3.1, 1.3, 0.1])
    assert values.velocity == pytest.approx([6.0, 3.0, 1.0])
    assert values.effort == [7.0] * 3


def test_circle_of_mimics_is_named() -> None:
    text = f"<robot>{mimic('a', 'b')}{mimic('b', 'a')}</robot>"
    with pytest.raises(JointError, match=r"^Found an infinite recursive mimic chain: \[a, b, a\]$"):
        joints_of(text)


def test_parent_that_is_not_there_is_named() -> None:
    with pytest.raises(JointError, match=r"joint \[a\] depends on joint \[z\].*\(there are: b\)"):
        joints_of(f"<robot>{mimic('a', 'z')}{joint('b', '')}</robot>")


def test_joint_without_limits_is_warned_of_and_published_as_zero() -> None:
    warnings: list[str] = []
    text = '<robot><joint name="a" type="revolute"/><joint name="b" type="continuous"/></robot>'
    joints = read_joints(text, JointOptions(), warnings.append)
    assert warnings == ["a is not fixed, nor continuous, but limits are not specified!"]
    assert joints.values().name == ["a", "b"]
    assert joints.free["b"].upper == math.pi


def test_messages_of_other_nodes_set_joint_values() -> None:
    joints = joints_of()
    joints.update(["elbow", "unknown", "shoulder"], [1.5, 2.0], [], [0.1, 0.2, 0.3])
    values = joints.values()
    assert values.position[:2] == [0.0, 1.5]
    assert values.effort[:2] == [0.3, 0.1]


def test_delta_moves_to_and_fro() -> None:
    swinging = FreeJoint(-1, 1, 0, 0.0)
    turning = FreeJoint(-1, 1, 0, None, is_continuous=True)
    seen = []
    for _ in range(6):
        swinging.advance(0.75)
        turning.advance(0.75)
        seen.append((swinging.position, turning.position))
    assert seen == [(0.75, 0.75), (1, -1), (0.25, -0.25), (-0.5, 0.5), (-1, -1), (-0.25, -0.25)]


def test_collada_has_degrees() -> None:
    text = (
        "<COLLADA><kinematics_model><technique_common><joint name='j'><revolute><limits><min>-90</min><max>180</max>"
        "</limits></revolute></joint><joint name='k'/></technique_common></kinematics_model></COLLADA>"
    )
    warnings: list[str] = []
    joints = read_joints(text, JointOptions(), warnings.append)
    assert (joints.free["j"].lower, joints.free["j"].upper) == pytest.approx((-math.pi / 2, math.pi))
    assert warnings == ["Unknown joint type k"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "<robot",
        "<model/>",
        "<robot><joint name='j' type='continuous'><mimic joint='x' offset='y'/></joint></robot>",
    ],
)
def test_text_that_is_not_a_description_is_refused(text: str) -> None:
    with pytest.raises(JointError, match=r"^robot_description"):
        read_joints(text, JointOptions(), print)
