"""The PID controller, compared with control_toolbox's equations."""

from __future__ import annotations

import math

import pytest

from minirospy.core.control.controller import ControllerError
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.pid import Pid, PidGains, PidTerms


def test_the_command_is_the_sum_of_the_three_terms() -> None:
    pid = Pid(2.0, 3.0, 0.5, 100.0, -100.0)
    terms: list[PidTerms] = []
    pid.on_computed = terms.append
    assert pid.compute(1.0, None, 0.1) == pytest.approx(2.0 + 3.0 * 0.1 + 0.5 * 10.0)
    assert pid.compute(0.5, None, 0.1) == pytest.approx(1.0 + 3.0 * 0.15 - 0.5 * 5.0)
    assert pid.compute(0.5, 7.0, 0.1) == pytest.approx(1.0 + 3.0 * 0.2 + 0.5 * 7.0)
    assert terms[0] == pytest.approx((0.1, 2.0, 0.3, 5.0))
    pid.reset()
    assert pid.compute(1.0, None, 0.1) == pytest.approx(2.0 + 3.0 * 0.1 + 0.5 * 10.0)


@pytest.mark.parametrize("dt", [0.0, math.nan, math.inf])
def test_without_a_time_step_the_command_is_0_and_nothing_changes(dt: float) -> None:
    pid = Pid(1.0, 1.0, 1.0, 10.0, -10.0)
    assert pid.compute(5.0, None, dt) == 0.0
    assert (pid.error, pid.error_integral, pid.error_rate) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_never_reach_the_command(wrong: float) -> None:
    pid = Pid(1.0, 1.0, 0.0, 10.0, -10.0)
    assert pid.compute(wrong, None, 0.1) == 0.0
    assert pid.compute(1.0, wrong, 0.1) == 0.0
    pid.gains = PidGains(wrong, wrong, wrong, 10.0, -10.0)
    assert pid.compute(1.0, None, 0.1) == 0.0
    pid.gains = PidGains(1.0, 1.0, 0.0, 10.0, -10.0)
    assert pid.compute(1.0, None, 0.1) == pytest.approx(1.1)


def test_i_without_a_clamp_has_no_effect() -> None:
    assert Pid(1.0, 5.0).compute(1.0, None, 0.1) == 1.0


@pytest.mark.parametrize(("antiwindup", "after"), [(False, 1.0), (True, 0.8)])
def test_antiwindup_clamps_the_integral_instead_of_its_term(antiwindup: bool, after: float) -> None:
    pid = Pid(0.0, 2.0, 0.0, 1.0, -1.0, antiwindup)
    for _ in range(20):
        command = pid.compute(1.0, None, 0.1)
    assert command == 1.0
    assert pid.error_integral == pytest.approx(0.5 if antiwindup else 2.0)
    assert pid.compute(-1.0, None, 0.1) == pytest.approx(after)


def test_antiwindup_clamps_with_a_negative_gain() -> None:
    pid = Pid(0.0, -2.0, 0.0, 1.0, -0.5, True)
    assert [pid.compute(10.0, None, 1.0), pid.compute(-100.0, None, 1.0)] == [-0.5, 1.0]


def test_time_backwards_keeps_the_last_derivative_as_in_ros() -> None:
    pid = Pid(1.0, 0.0, 1.0)
    pid.compute(1.0, None, 0.5)
    assert pid.compute(3.0, None, -0.5) == pytest.approx(3.0 + 2.0)
    assert pid.compute(2.0, None, 0.5) == pytest.approx(2.0 + 2.0)


def test_gains_are_read_as_in_ros() -> None:
    def read(values: dict[str, object]) -> PidGains:
        return PidGains.read(Parameters("/arm/pid", values))

    assert read({"p": 3}) == (3.0, 0.0, 0.0, 0.0, 0.0, False)
    assert read({"p": 1.0, "i": 2, "d": 3.0, "i_clamp": -4.0}) == (1.0, 2.0, 3.0, 4.0, -4.0, False)
    assert read({"p": 1.0, "i_clamp": 4.0, "i_clamp_min": 5.0, "antiwindup": True})[3:] == (4.0, -5.0, True)
    assert read({"p": 1.0, "i_clamp": 4.0, "i_clamp_max": -6.0})[3:5] == (6.0, -4.0)
    with pytest.raises(ControllerError, match=r"^No p gain specified for pid\.  Namespace: /arm/pid$"):
        read({"i": 1.0})
    with pytest.raises(ControllerError):
        read({"p": "much"})
    with pytest.raises(ValueError, match="/arm/pid/p is nan"):
        read({"p": math.nan})
