"""The robots of the examples: their descriptions become the models that the simulation needs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import minirospy.ros.gazebo_ros.paths as paths_module
from minirospy.core.sdf.model import Mimic, Model
from minirospy.core.sdf.read import parse_urdf, parse_world
from minirospy.ros.gazebo_ros.paths import resource_paths
from minirospy.ros.xacro.commands.xacro import main

Read = Callable[[str, str], Model]

ROS = Path(paths_module.__file__).parents[1]


@pytest.fixture
def read(capsys: pytest.CaptureFixture[str]) -> Read:
    def run(package: str, file: str) -> Model:
        assert main([str(ROS / package / "urdf" / file)]) == 0
        model = parse_urdf(capsys.readouterr().out)
        assert model.warnings == ()
        return model

    return run


def test_the_diff_drive_stands_on_its_wheels(read: Read) -> None:
    robot = read("diff_drive_robot", "robot.xacro")
    assert list(robot.links) == ["base_footprint", "left_wheel", "right_wheel"]
    assert robot.links["left_wheel"].pose.position == pytest.approx((0.0, 0.18, 0.08))
    body = robot.links["base_footprint"]
    assert {sensor.name: sensor.kind for sensor in body.sensors} == {
        "laser": "ray",
        "camera": "camera",
        "imu": "imu",
    }
    assert [collision.surface.mu for collision in body.collisions] == [1.0, 0.0, 0.0]
    assert {"base_link", "laser", "camera_optical", "imu_link"} <= set(robot.lumped)
    assert [plugin.library for plugin in robot.plugins] == ["gazebo_ros_diff_drive"]


def test_the_arm_of_two_links_is_fixed_to_the_world(read: Read) -> None:
    arm = read("two_link_arm_gazebo", "arm.xacro")
    assert [(joint.name, joint.kind, joint.parent) for joint in arm.joints.values()] == [
        ("stand_joint", "fixed", "world"),
        ("shoulder", "continuous", "stand"),
        ("elbow", "continuous", "upper_arm"),
    ]
    # A rod of 0.5 m with a radius of 3 cm and 700 kg/m^3.
    assert arm.links["upper_arm"].inertial.mass == pytest.approx(0.98960169)
    assert [plugin.library for plugin in arm.plugins] == ["gazebo_ros_control"]


def test_the_arm_of_six_joints_has_a_gripper_that_closes_on_both_sides(read: Read) -> None:
    arm = read("six_joint_arm", "arm.xacro")
    moving = [joint.name for joint in arm.joints.values() if joint.kind == "revolute"]
    assert moving == [f"joint_{number}" for number in range(1, 7)]
    follower = arm.joints["right_finger_joint"]
    assert follower.mimic == Mimic("gripper")
    assert (arm.joints["gripper"].axis.xyz[1], follower.axis.xyz[1]) == (1.0, -1.0)


def test_the_table_is_within_reach_of_the_arm() -> None:
    path = ROS / "six_joint_arm" / "worlds" / "table.world"
    world = parse_world(path.read_bytes(), resource_paths({}).resolve, file=str(path))
    assert world.warnings == ()
    heights = {model.name: model.pose.position[2] for model in world.models}
    assert heights == {
        "ground_plane": 0,
        "low_table": 0,
        "red_cube": 0.45,
        "green_cube": 0.45,
        "blue_cube": 0.45,
    }
