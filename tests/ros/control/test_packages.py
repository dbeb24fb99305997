"""A robot's package that depends on the packages of ros_control: rosdep finds them, and catkin_make builds it."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.ros.catkin.commands.make import catkin_make
from minirospy.ros.rosdep.commands.rosdep import main as rosdep
from tests.conftest import write_files

NAMES = (
    "controller_manager ros_control ros_controllers diff_drive_controller joint_state_controller effort_controllers "
    "position_controllers velocity_controllers imu_sensor_controller force_torque_sensor_controller control_toolbox "
    "ackermann_steering_controller four_wheel_steering_controller forward_command_controller hardware_interface "
    "controller_interface realtime_tools transmission_interface joint_limits_interface"
)


def test_a_robots_package_builds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    depends = "".join(
        f"<build_depend>{name}</build_depend><run_depend>{name}</run_depend>" for name in NAMES.split()
    )
    write_files(
        tmp_path / "src" / "robot_control",
        {
            "package.xml": "<package><name>robot_control</name><version>0.1.0</version><description>Robot</description>"
            "<maintainer email='me@example.com'>me</maintainer><license>BSD</license>"
            f"<buildtool_depend>catkin</buildtool_depend>{depends}</package>",
            "CMakeLists.txt": "cmake_minimum_required(VERSION 2.8.3)\nproject(robot_control)\n"
            f"find_package(catkin REQUIRED COMPONENTS {NAMES})\ncatkin_package(CATKIN_DEPENDS {NAMES})\n",
        },
    )
    monkeypatch.chdir(tmp_path)
    assert rosdep(["check", "--from-paths", "src", "--ignore-src"]) in (0, 1)
    checked = capfd.readouterr()
    missing = {line.split()[0] for line in checked.out.splitlines() if "no package" in line}
    assert missing <= {"gripper_action_controller", "joint_trajectory_controller"}
    assert catkin_make([]) == 0
    made = capfd.readouterr()
    assert "robot_control: nothing to generate" in made.out
    assert "going on without" not in made.out + made.err
