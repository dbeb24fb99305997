"""The loopback: joints that follow their commands within the description's limits."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from minirospy.base.times import Duration, Time
from minirospy.core.control.hardware import COMMAND_INTERFACES, HardwareError, Interface
from minirospy.core.control.loopback import LoopbackHardware
from minirospy.core.control.transmissions import Transmission
from minirospy.core.urdf.read import parse_robot, read_robot

ROBOT = read_robot(Path(__file__).parents[1] / "urdf" / "arm.urdf")
NOW, PERIOD = Time(5), Duration(0, 10_000_000)


def hardware(*transmissions: Transmission, **initial: float) -> LoopbackHardware:
    return LoopbackHardware(ROBOT, list(transmissions), initial)


def test_all_movable_joints_have_all_interfaces_without_transmissions() -> None:
    joints = hardware().joints
    assert {name: joint.position for name, joint in joints.items()} == {
        "shoulder": 0.0,
        "elbow": 0.0,
        "left": 0.01,  # 0 is outside its limits
        "right": pytest.approx(0.12),  # mimics left
    }
    assert joints["elbow"].interfaces == COMMAND_INTERFACES
    assert joints["right"].interfaces == frozenset()


def test_transmissions_choose_joints_and_interfaces() -> None:
    warnings: list[str] = []
    transmissions = [
        Transmission("t", "s", "elbow", (Interface.EFFORT,)),
        Transmission("u", "s", "nope", (Interface.EFFORT,)),
    ]
    joints = LoopbackHardware(ROBOT, transmissions, warn=warnings.append).joints
    assert {name: joint.interfaces for name, joint in joints.items()} == {
        "elbow": frozenset({Interface.EFFORT})
    }
    assert warnings == ["transmission 'u': the robot has no movable joint 'nope', so it is skipped"]


def test_mimic_joint_with_a_transmission_follows_only_while_no_controller_has_it() -> None:
    transmissions = [Transmission("t", "s", name, (Interface.POSITION,)) for name in ("left", "right")]
    robot = hardware(*transmissions)
    left, right = robot.joints["left"], robot.joints["right"]
    assert right.interfaces == {Interface.POSITION}
    left.active, left.position_command = Interface.POSITION, 0.02
    robot.read(NOW, PERIOD)
    assert (left.position, right.position) == (0.02, pytest.approx(0.14))
    right.active, right.position_command = Interface.POSITION, 0.03
    robot.read(NOW, PERIOD)
    assert right.position == 0.03


def test_mimic_of_a_mimic_follows_in_the_same_cycle() -> None:
    joints = "".join(
        f'<link name="{name}_link"/><joint name="{name}" type="prismatic"><parent link="base"/><child link="{name}_link"/>'
        f'<limit lower="-9" upper="9" effort="1" velocity="1"/>{mimic}</joint>'
        for name, mimic in (
            ("c", '<mimic joint="b" multiplier="3" offset="0.5"/>'),
            ("b", '<mimic joint="a" multiplier="-2"/>'),
            ("a", ""),
            ("x", '<mimic joint="y"/>'),
            ("y", '<mimic joint="x"/>'),
        )
    )
    robot = LoopbackHardware(parse_robot(f'<robot name="r"><link name="base"/>{joints}</robot>'), [])
    assert {name: joint.position for name, joint in robot.joints.items()} == {"a": 0.0, "b": 0.0, "c": 0.5}
    a = robot.joints["a"]
    a.active, a.position_command = Interface.POSITION, 0.01
    robot.read(NOW, PERIOD)
    assert [robot.joints[name].position for name in "abc"] == pytest.approx([0.01, -0.02, 0.44])
    assert [robot.joints[name].velocity for name in "abc"] == pytest.approx([1.0, -2.0, -6.0])


def test_initial_position_without_an_effect_is_named() -> None:
    warnings: list[str] = []
    transmissions = [Transmission("t", "s", "elbow", (Interface.EFFORT,))]
    LoopbackHardware(ROBOT, transmissions, {"elbow": 1.0, "shoulder": 1.0}, warnings.append)
    assert warnings == ["the initial position of joint 'shoulder' is ignored, because it has no transmission"]


def test_position_command_is_reached_within_the_limits() -> None:
    robot = hardware(shoulder=0.5)
    shoulder, _, left, right = robot.joints.values()
    assert shoulder.position == 0.5
    shoulder.active = left.active = Interface.POSITION
    shoulder.position_command, left.position_command = 0.51, 7.0
    robot.read(NOW, PERIOD)
    assert (shoulder.position, shoulder.velocity) == (0.51, pytest.approx(1.0))
    assert (left.position, right.position) == (0.05, pytest.approx(0.2))
    shoulder.position_command = math.nan
    robot.read(NOW, PERIOD)
    assert (shoulder.position, shoulder.velocity) == (0.51, 0.0)


def test_velocity_counts_for_the_period_in_which_the_joint_moved() -> None:
    robot = hardware()
    elbow = robot.joints["elbow"]
    elbow.velocity_command, elbow.active = 2.0, Interface.VELOCITY
    robot.write(NOW, PERIOD)
    assert elbow.position == 0.0
    robot.read(NOW, Duration(0, 30_000_000))
    assert (elbow.position, elbow.velocity) == (pytest.approx(0.06), pytest.approx(2.0))


def test_joint_without_a_controller_stands_still() -> None:
    robot = hardware()
    elbow = robot.joints["elbow"]
    elbow.velocity_command, elbow.active = 2.0, Interface.VELOCITY
    robot.read(NOW, PERIOD)
    assert (elbow.position, elbow.velocity) == (pytest.approx(0.02), pytest.approx(2.0))
    elbow.active = None
    robot.read(NOW, PERIOD)
    assert (elbow.position, elbow.velocity) == (pytest.approx(0.02), 0.0)


@pytest.mark.parametrize("cycles", [1, 100])
def test_effort_moves_a_damped_mass(cycles: int) -> None:
    robot = hardware()
    elbow = robot.joints["elbow"]
    elbow.effort_command, elbow.active = 2.0, Interface.EFFORT
    for _ in range(cycles):
        robot.read(NOW, Duration(0, 1_000_000_000 // cycles) if cycles > 1 else Duration(1))
    # v' = F - v, from rest: v = F (1 - e^-t), x = F (t - 1 + e^-t)
    assert elbow.velocity == pytest.approx(2.0 * (1 - math.exp(-1)))
    assert elbow.position == pytest.approx(2.0 * math.exp(-1))
    assert elbow.effort == 2.0


def test_initial_positions_are_checked() -> None:
    with pytest.raises(HardwareError, match="initial position of 'nope': the robot has no such joint"):
        hardware(nope=1.0)
    with pytest.raises(HardwareError, match="joint 'elbow': its position is nan"):
        hardware(elbow=math.nan)


def test_sensors_stand_still() -> None:
    robot = hardware()
    robot.add_sensors({"imu": "imu_link"}, {"wrist": "tool"})
    assert robot.imus["imu"].linear_acceleration == (0.0, 0.0, 9.81)
    assert robot.force_torque_sensors["wrist"].frame_id == "tool"
    assert robot.resources()[Interface.IMU] == ["imu"]
