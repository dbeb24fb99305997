"""Limits from a description and from parameters, and their effect on commands, as joint_limits_interface has it."""

from __future__ import annotations

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.times import Duration
from minirospy.core.control.hardware import Interface, Joint
from minirospy.core.control.limits import JointLimits, LimitEnforcer, SoftLimits, read_limits
from minirospy.core.control.parameters import Parameters
from minirospy.core.urdf.read import parse_robot

PERIOD = Duration(0, 100_000_000)
SECONDS = 0.1


def read(joint: str = "", **parameters: object) -> JointLimits:
    """Return the limits of a joint, whose tags are given, and of parameters."""
    kind = "continuous" if "continuous" in joint else "revolute"
    text = (
        '<robot name="r"><link name="a"/><link name="b"/>'
        f'<joint name="j" type="{kind}"><parent link="a"/><child link="b"/>{joint}</joint></robot>'
    )
    robot = parse_robot(text) if joint else None
    return read_limits(robot and robot.joints["j"], Parameters("/joint_limits/j", parameters), "j")


LIMIT = '<limit lower="-1" upper="2" effort="10" velocity="3"/>'


def test_limits_of_a_description() -> None:
    assert read(LIMIT) == JointLimits(-1.0, 2.0, 3.0, inf, 10.0)
    assert read(LIMIT + "<!-- continuous -->") == JointLimits(-inf, inf, 3.0, inf, 10.0)
    assert read() == JointLimits()


def test_parameters_override_the_description() -> None:
    assert read(LIMIT, has_velocity_limits=True, max_velocity=1) == JointLimits(-1.0, 2.0, 1.0, inf, 10.0)
    assert read(LIMIT, has_acceleration_limits=True, max_acceleration=5.0).acceleration == 5.0
    assert read(LIMIT, has_effort_limits=True, max_effort=5.0).effort == 5.0
    positions = read(LIMIT, has_position_limits=True, min_position=-0.5, max_position=0.5)
    assert (positions.lower, positions.upper) == (-0.5, 0.5)


def test_flags_without_values_and_values_without_flags_have_no_effect() -> None:
    assert read(LIMIT, max_velocity=1.0, min_position=0.0, max_position=1.0) == read(LIMIT)
    assert read(LIMIT, has_velocity_limits=True, has_position_limits=True, min_position=0.0) == read(LIMIT)
    assert read(LIMIT, has_velocity_limits="yes", max_velocity=1.0) == read(LIMIT)


def test_false_flags_remove_limits() -> None:
    free = read(LIMIT, has_velocity_limits=False, has_position_limits=False, has_effort_limits=False)
    assert free == JointLimits()


def test_soft_limits() -> None:
    safety = (
        '<safety_controller k_velocity="4" k_position="5" soft_lower_limit="-0.9" soft_upper_limit="1.9"/>'
    )
    assert read(LIMIT + safety).soft == SoftLimits(-0.9, 1.9, 5.0, 4.0)
    soft = {"soft_lower_limit": 0, "soft_upper_limit": 1.0, "k_position": 2, "k_velocity": 3.0}
    assert read(LIMIT, has_soft_limits=True, **soft).soft == SoftLimits(0.0, 1.0, 2.0, 3.0)
    assert read(LIMIT, **soft).soft is None
    del soft["k_velocity"]
    assert read(LIMIT, has_soft_limits=True, **soft).soft is None
    assert (
        read(LIMIT + '<safety_controller k_velocity="4"/>').soft is None
    )  # k_position 0 would stop the joint


def test_limits_that_no_joint_can_keep_are_refused() -> None:
    with pytest.raises(ValueError, match=r"joint 'j': its lowest position 3.0 is above its highest, 1.0"):
        read(has_position_limits=True, min_position=3.0, max_position=1.0)
    with pytest.raises(ValueError, match="/joint_limits/j/max_velocity is nan"):
        read(has_velocity_limits=True, max_velocity=nan)


class Bench:
    def __init__(self, interface: Interface, limits: JointLimits, position: float = 0.0) -> None:
        self.joint = Joint("j", frozenset({interface}), position)
        self.enforcer = LimitEnforcer([self.joint], {"j": limits})
        self.joint.active = interface

    def position(self, command: float) -> float:
        self.joint.position_command = command
        self.enforcer.enforce(PERIOD)
        return self.joint.position_command

    def velocity(self, command: float) -> float:
        self.joint.velocity_command = command
        self.enforcer.enforce(PERIOD)
        return self.joint.velocity_command

    def effort(self, command: float) -> float:
        self.joint.effort_command = command
        self.enforcer.enforce(PERIOD)
        return self.joint.effort_command


def test_position_is_cut_and_rate_limited() -> None:
    bench = Bench(Interface.POSITION, JointLimits(-1.0, 0.5, velocity=2.0))
    assert [bench.position(9.0) for _ in range(4)] == pytest.approx([0.2, 0.4, 0.5, 0.5])
    assert [bench.position(-9.0) for _ in range(2)] == pytest.approx([0.3, 0.1])
    assert bench.position(0.15) == 0.15


def test_rate_limit_begins_at_the_joint_again_after_a_switch() -> None:
    bench = Bench(Interface.POSITION, JointLimits(velocity=1.0))
    assert bench.position(5.0) == pytest.approx(0.1)
    bench.joint.active, bench.joint.position = None, 3.0
    bench.enforcer.enforce(PERIOD)
    bench.joint.active = Interface.POSITION
    assert bench.position(5.0) == pytest.approx(3.1)


def test_soft_limit_slows_a_position_down() -> None:
    soft = SoftLimits(-1.0, 1.0, k_position=5.0, k_velocity=1.0)
    bench = Bench(Interface.POSITION, JointLimits(-2.0, 2.0, velocity=4.0, soft=soft))
    # Each cycle halves the distance to the soft limit, once the velocity limit is not the smaller one.
    assert [bench.position(9.0) for _ in range(4)] == pytest.approx([0.4, 0.7, 0.85, 0.925])


def test_velocity_is_cut_and_limited_by_acceleration() -> None:
    bench = Bench(Interface.VELOCITY, JointLimits(velocity=0.5, acceleration=2.0))
    assert [bench.velocity(9.0) for _ in range(4)] == pytest.approx([0.2, 0.4, 0.5, 0.5])
    assert bench.velocity(-9.0) == pytest.approx(0.3)


def test_soft_limit_slows_a_velocity_down() -> None:
    soft = SoftLimits(-1.0, 1.0, k_position=2.0, k_velocity=1.0)
    limits = JointLimits(-1.1, 1.1, velocity=1.0, acceleration=100.0, soft=soft)
    bench = Bench(Interface.VELOCITY, limits, position=0.9)
    assert bench.velocity(9.0) == pytest.approx(0.2)
    bench.joint.position = 1.05
    assert bench.velocity(9.0) == pytest.approx(-0.1)


def test_effort_does_not_push_beyond_a_limit() -> None:
    bench = Bench(Interface.EFFORT, JointLimits(-1.0, 1.0, velocity=1.0, effort=10.0))
    assert (bench.effort(50.0), bench.effort(-50.0)) == (10.0, -10.0)
    bench.joint.position = 1.01
    assert (bench.effort(5.0), bench.effort(-5.0)) == (0.0, -5.0)
    bench.joint.position, bench.joint.velocity = 0.0, -1.5
    assert (bench.effort(5.0), bench.effort(-5.0)) == (5.0, 0.0)


def test_soft_limit_of_an_effort_depends_on_the_velocity() -> None:
    soft = SoftLimits(-1.0, 1.0, k_position=2.0, k_velocity=3.0)
    bench = Bench(
        Interface.EFFORT, JointLimits(-1.1, 1.1, velocity=1.0, effort=10.0, soft=soft), position=0.9
    )
    bench.joint.velocity = 0.5  # the highest velocity is 2 * 0.1
    assert bench.effort(5.0) == pytest.approx(-3.0 * (0.5 - 0.2))


def test_position_with_velocity_is_limited_in_both() -> None:
    bench = Bench(Interface.POS_VEL_ACC, JointLimits(-1.0, 1.0, velocity=2.0, acceleration=4.0))
    bench.joint.velocity_command, bench.joint.acceleration_command = 5.0, -6.0
    assert bench.position(3.0) == pytest.approx(0.2)
    assert (bench.joint.velocity_command, bench.joint.acceleration_command) == (2.0, -4.0)


@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_command_that_is_not_finite_is_replaced_and_reported(value: float) -> None:
    bench = Bench(Interface.POSITION, JointLimits(), position=0.3)
    bench.joint.position_command = value
    assert bench.enforcer.enforce(PERIOD) == ["j"]
    assert bench.joint.position_command == 0.3
    assert Bench(Interface.VELOCITY, JointLimits()).velocity(value) == 0.0
    assert Bench(Interface.EFFORT, JointLimits()).effort(value) == 0.0
    joint = Bench(Interface.POS_VEL, JointLimits()).joint
    joint.velocity_command = value
    LimitEnforcer([joint], {}).enforce(PERIOD)
    assert joint.velocity_command == 0.0


def test_joint_without_a_controller_is_left_alone() -> None:
    bench = Bench(Interface.POSITION, JointLimits(-1.0, 1.0))
    bench.joint.active = None
    assert bench.position(7.0) == 7.0


@pytest.mark.parametrize("start", [-1.25, 1.25])
def test_joint_outside_its_limits_comes_back_without_a_jump(start: float) -> None:
    bench = Bench(Interface.POSITION, JointLimits(-1.0, 1.0, velocity=1.0), start)
    sign = 1 if start > 0 else -1
    expected = [1.15 * sign, 1.05 * sign, 1.0 * sign, 1.0 * sign]
    assert [bench.position(5.0 * sign) for _ in range(4)] == pytest.approx(expected)


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=30), st.floats(-0.9, 0.9))
def test_no_command_leaves_the_limits_or_jumps(commands: list[float], start: float) -> None:
    limits = JointLimits(-1.0, 1.0, velocity=2.0)
    bench = Bench(Interface.POSITION, limits, start)
    before = start
    for command in commands:
        after = bench.position(command)
        assert limits.lower <= after <= limits.upper
        assert abs(after - before) <= limits.velocity * SECONDS + 1e-9
        before = after
