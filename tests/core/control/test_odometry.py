"""Odometry, compared with the closed form of arcs, and with the mean of the last velocities."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.control.odometry import AckermannOdometry, DiffDriveOdometry, Odometry

MS = 1_000_000
SPEEDS = st.floats(-3.0, 3.0)


def closed_form(linear: float, angular: float, seconds: float) -> tuple[float, float, float]:
    """Return the pose after a motion at constant velocities."""
    turn = angular * seconds
    if abs(turn) < 1e-9:
        return linear * seconds, 0.0, turn
    radius = linear / angular
    return radius * math.sin(turn), radius * (1.0 - math.cos(turn)), turn


@given(SPEEDS, SPEEDS, st.integers(1, 200), st.integers(1, 100))
def test_diff_drive_follows_arcs(linear: float, angular: float, cycles: int, period_ms: int) -> None:
    odometry = DiffDriveOdometry(10)
    odometry.start(0)
    step = period_ms / 1000
    for cycle in range(1, cycles + 1):
        t = cycle * step
        odometry.update(
            (linear - angular * 0.25) * t / 0.1,
            (linear + angular * 0.25) * t / 0.2,
            separation=0.5,
            left_radius=0.1,
            right_radius=0.2,
            time=cycle * period_ms * MS,
        )
    expected = closed_form(linear, angular, cycles * step)
    assert (odometry.x, odometry.y, odometry.heading) == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert (odometry.linear, odometry.angular) == pytest.approx((linear, angular), rel=1e-6, abs=1e-6)


def test_a_circle_closes() -> None:
    odometry = DiffDriveOdometry(10)
    for cycle in range(1, 1001):
        turn = 2 * math.pi * cycle / 1000
        odometry.update(
            turn * 0.75 / 0.1,
            turn * 1.25 / 0.1,
            separation=0.5,
            left_radius=0.1,
            right_radius=0.1,
            time=cycle * MS,
        )
    assert math.hypot(odometry.x, odometry.y) < 1e-9
    assert odometry.heading == pytest.approx(2 * math.pi)


@given(SPEEDS, st.floats(-1.2, 1.2), st.integers(1, 200))
def test_ackermann_follows_arcs(linear: float, steering: float, cycles: int) -> None:
    odometry = AckermannOdometry(10)
    for cycle in range(1, cycles + 1):
        t = cycle * 0.01
        odometry.update(linear * t / 0.3, steering, wheelbase=1.2, radius=0.3, time=cycle * 10 * MS)
    angular = linear * math.tan(steering) / 1.2
    expected = closed_form(linear, angular, cycles * 0.01)
    assert (odometry.x, odometry.y, odometry.heading) == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert odometry.angular == pytest.approx(angular, rel=1e-6, abs=1e-6)


@given(SPEEDS, SPEEDS)
def test_open_loop_follows_the_commands(linear: float, angular: float) -> None:
    odometry = Odometry(10)
    odometry.start(5 * MS)
    for cycle in range(1, 101):
        odometry.move_open_loop(linear, angular, (5 + cycle * 20) * MS)
    expected = closed_form(linear, angular, 2.0)
    assert (odometry.x, odometry.y, odometry.heading) == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert (odometry.linear, odometry.angular) == (linear, angular)


def test_the_velocity_is_the_mean_of_the_last_cycles() -> None:
    odometry = Odometry(3)
    odometry.start(0)
    for cycle, distance in enumerate([1.0, 2.0, 3.0, 4.0], 1):
        odometry.move(distance, 0.0, cycle * 1000 * MS)
    assert odometry.linear == pytest.approx(3.0)
    odometry.start(10_000 * MS)
    odometry.move(8.0, 0.0, 11_000 * MS)
    assert odometry.linear == pytest.approx(8.0)
    assert odometry.x == pytest.approx(18.0)


def test_short_steps_and_time_backwards_move_the_pose_but_measure_no_velocity() -> None:
    odometry = Odometry(10)
    odometry.start(1000 * MS)
    odometry.move(1.0, 0.0, 2000 * MS)
    odometry.move(0.5, 0.0, 2000 * MS)
    odometry.move(0.5, 0.0, 100 * MS)
    assert (odometry.x, odometry.linear) == (2.0, 1.0)
    odometry.move(1.0, 0.0, 600 * MS)
    assert (odometry.x, odometry.linear) == (3.0, 1.5)
    odometry.move_open_loop(1.0, 0.0, 100 * MS)
    assert odometry.x == 3.0
