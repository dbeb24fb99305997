"""The cycles in which a controller publishes."""

from __future__ import annotations

import pytest

from minirospy.base.times import Time
from minirospy.core.control.controller import ControllerError
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.rates import PublishRate


def due(rate: PublishRate, first_ms: int, cycles: int, period_ms: int = 10) -> list[int]:
    """Return the milliseconds of the cycles in which to publish."""
    times = [first_ms + each * period_ms for each in range(cycles)]
    return [each for each in times if rate.is_due(Time(each // 1000, each % 1000 * 1_000_000))]


def test_the_rate_holds_in_the_cycles_of_the_loop() -> None:
    rate = PublishRate(20.0)
    rate.start(Time(1))
    assert due(rate, 1010, 17) == [1060, 1110, 1160]


def test_the_first_message_can_be_due_in_the_next_cycle() -> None:
    rate = PublishRate(20.0)
    rate.start(Time(1), is_due=True)
    assert due(rate, 1010, 7) == [1010, 1060]


def test_a_rate_above_that_of_the_loop_publishes_in_each_cycle() -> None:
    rate = PublishRate(1000.0)
    rate.start(Time(1))
    assert len(due(rate, 1010, 300)) == 300


def test_a_long_gap_causes_no_burst() -> None:
    rate = PublishRate(10.0)
    rate.start(Time(1))
    assert due(rate, 9000, 25) == [9000, 9110, 9210]


def test_time_backwards_starts_again() -> None:
    rate = PublishRate(10.0)
    rate.start(Time(1000))
    assert due(rate, 5000, 25) == [5110, 5210]


@pytest.mark.parametrize("hertz", [0.0, -5.0])
def test_a_rate_that_is_not_positive_never_publishes(hertz: float) -> None:
    rate = PublishRate(hertz)
    rate.start(Time(1), is_due=True)
    assert due(rate, 1010, 500) == []


def test_publish_rate_is_required() -> None:
    with pytest.raises(ControllerError, match=r"^Parameter 'publish_rate' not set$"):
        PublishRate.read(Parameters("/c", {"publish_rate": "50"}))
    assert due(PublishRate.read(Parameters("/c", {"publish_rate": 50})), 1000, 6) == [1030, 1050]


def test_the_rate_can_change() -> None:
    rate = PublishRate(20.0)
    rate.start(Time(1))
    rate.set(0.0)
    assert due(rate, 1010, 20) == []
    rate.set(10.0)
    assert due(rate, 1210, 20) == [1210, 1220, 1310]
