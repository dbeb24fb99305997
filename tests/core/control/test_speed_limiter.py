"""The limits of velocity, acceleration and jerk, cycle by cycle."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.core.control.parameters import Parameters
from minirospy.core.control.speed_limiter import Range, SpeedLimiter

DT = 0.01


def follow(limiter: SpeedLimiter, wanted: float, cycles: int) -> list[float]:
    """Return the velocities of a robot that starts at rest, the first two of which are 0."""
    speeds = [0.0, 0.0]
    for _ in range(cycles):
        speeds.append(limiter.limit(wanted, speeds[-1], speeds[-2], DT))
    return speeds


def test_without_limits_the_wanted_velocity_is_reached_at_once() -> None:
    assert follow(SpeedLimiter(), 7.0, 1)[-1] == 7.0


def test_the_velocity_is_limited_on_both_sides() -> None:
    limiter = SpeedLimiter(velocity=Range(-0.5, 1.0))
    assert follow(limiter, 7.0, 1)[-1] == 1.0
    assert follow(limiter, -7.0, 1)[-1] == -0.5
    assert follow(limiter, 0.3, 1)[-1] == 0.3


def test_the_acceleration_is_limited_at_the_tick() -> None:
    limiter = SpeedLimiter(acceleration=Range(-4.0, 2.0))
    assert follow(limiter, 1.0, 51) == pytest.approx([0.0, *(k * 2.0 * DT for k in range(51)), 1.0])
    assert limiter.limit(0.0, 1.0, 1.0, DT) == pytest.approx(1.0 - 4.0 * DT)


def test_the_jerk_is_limited_at_the_tick() -> None:
    limiter = SpeedLimiter(jerk=Range(-3.0, 3.0))
    step = 2.0 * 3.0 * DT * DT
    assert follow(limiter, 1.0, 3)[2:] == pytest.approx([step, 3 * step, 6 * step])


@given(st.lists(st.floats(-10.0, 10.0), max_size=100))
def test_no_command_exceeds_a_limit(wanted: list[float]) -> None:
    limiter = SpeedLimiter(Range(-1.0, 1.5), Range(-2.0, 3.0))
    last, before = 0.0, 0.0
    for each in wanted:
        speed = limiter.limit(each, last, before, DT)
        assert -1.0 <= speed <= 1.5
        assert -2.0 * DT - 1e-9 <= speed - last <= 3.0 * DT + 1e-9
        before, last = last, speed


def test_no_time_and_time_backwards_keep_the_velocity() -> None:
    limiter = SpeedLimiter(acceleration=Range(-1.0, 1.0))
    assert limiter.limit(5.0, 0.2, 0.1, 0.0) == 0.2
    assert limiter.limit(5.0, 0.2, 0.1, -1.0) == 0.2


def test_limits_are_read_as_in_ros() -> None:
    values = {
        "has_velocity_limits": True,
        "max_velocity": 2,
        "has_acceleration_limits": True,
        "max_jerk": 1.0,
    }
    assert SpeedLimiter.read(Parameters("/base/linear/x", values)) == SpeedLimiter(
        Range(-2.0, 2.0), Range(-0.0, 0.0), None
    )
    values |= {"min_velocity": -0.5, "max_acceleration": 1.0, "has_jerk_limits": True}
    assert SpeedLimiter.read(Parameters("/base/linear/x", values)) == SpeedLimiter(
        Range(-0.5, 2.0), Range(-1.0, 1.0), Range(-1.0, 1.0)
    )
    with pytest.raises(ValueError, match="/base/linear/x/max_velocity"):
        SpeedLimiter.read(Parameters("/base/linear/x", {"max_velocity": math.nan}))
