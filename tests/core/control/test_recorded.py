"""Odometry, speed limits and PID, compared with the numbers of ROS's C++ classes (make_recorded.py)."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from minirospy.core.control.odometry import AckermannOdometry, DiffDriveOdometry, Odometry
from minirospy.core.control.pid import Pid
from minirospy.core.control.speed_limiter import Range, SpeedLimiter
from minirospy.core.control.transmission_maps import DifferentialTransmission, FourBarLinkageTransmission

RECORDED: dict[str, list[list[float]]] = json.loads((Path(__file__).parent / "recorded.json").read_text())


def state(odometry: Odometry) -> list[float]:
    """Return the recorded values of an odometry."""
    return [odometry.x, odometry.y, odometry.heading, odometry.linear, odometry.angular]


def test_diff_drive_odometry() -> None:
    odometry, time = DiffDriveOdometry(5), 0
    for step, is_start, left, right, *expected in RECORDED["diff_drive"]:
        time += int(step)
        if is_start:
            odometry.start(time)
        odometry.update(left, right, separation=0.43, left_radius=0.11, right_radius=0.12, time=time)
        assert state(odometry) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_open_loop_odometry() -> None:
    odometry, time = Odometry(5), 0
    for step, linear, angular, *expected in RECORDED["open_loop"]:
        time += int(step)
        odometry.move_open_loop(linear, angular, time)
        assert state(odometry) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_ackermann_odometry() -> None:
    odometry, time = AckermannOdometry(10), 0
    for step, wheel, steering, *expected in RECORDED["ackermann"]:
        time += int(step)
        odometry.update(wheel, steering, wheelbase=1.3, radius=0.27, time=time)
        assert state(odometry) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("row", RECORDED["speed_limiter"])
def test_speed_limiter(row: list[float]) -> None:
    flags, *limits, wanted, last, before_last, dt, expected = row
    ranges = [Range(*limits[2 * k : 2 * k + 2]) if int(flags) & 1 << k else None for k in range(3)]
    assert SpeedLimiter(*ranges).limit(wanted, last, before_last, dt) == pytest.approx(expected, abs=1e-12)


def test_pid() -> None:
    pid, gains = Pid(), []
    for *row, is_reset, error, rate, step, command, integral in RECORDED["pid"]:
        if row != gains:
            gains = row
            pid = Pid(*gains[:5], antiwindup=bool(gains[5]))
        if is_reset:
            pid.reset()
        seen = pid.compute(math.nan if error is None else error, rate, step * 1e-9)
        assert (seen, pid.error_integral) == pytest.approx((command, integral), rel=1e-9, abs=1e-9)


def test_transmissions() -> None:
    for is_linkage, *numbers in RECORDED["transmissions"]:
        first, second, *pairs = ([numbers[at], numbers[at + 1]] for at in range(0, 24, 2))
        kind = FourBarLinkageTransmission if is_linkage else DifferentialTransmission
        offsets, position, velocity, effort, *expected = pairs
        tested = kind(first, second, offsets)
        found = (
            tested.joint_positions(position),
            tested.joint_velocities(velocity),
            tested.joint_efforts(effort),
            tested.actuator_positions(position),
            tested.actuator_velocities(velocity),
            tested.actuator_efforts(effort),
        )
        for values, right in zip(found, expected, strict=True):
            assert values == pytest.approx(right, rel=1e-9)
