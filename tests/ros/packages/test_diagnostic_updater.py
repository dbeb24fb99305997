"""diagnostic_updater with clocks that stand still or jump, and parameters that are not numbers.

tests/referee/cases/diagnostic_updater_tasks.py compares its other reports with real ROS.
"""

from __future__ import annotations

from unittest.mock import Mock

import pytest
from diagnostic_updater import (
    CompositeDiagnosticTask,
    DiagnosticStatusWrapper,
    FrequencyStatus,
    FrequencyStatusParam,
    FunctionDiagnosticTask,
    Updater,
)
from rospy import Time

from minirospy.ros.diagnostic_updater.diagnostic_updater import _diagnostic_updater as module


class Clock:
    now = 100.0


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> type[Clock]:
    Clock.now = 100.0
    monkeypatch.setattr(Time, "now", staticmethod(lambda: Time.from_sec(Clock.now)))
    return Clock


@pytest.fixture
def updater(monkeypatch: pytest.MonkeyPatch) -> Updater:
    for name in ("Publisher", "get_param_cached", "logerr_throttle", "logwarn"):
        monkeypatch.setattr(module.rospy, name, Mock())
    module.rospy.get_param_cached.return_value = 1  # type: ignore[attr-defined]
    updater = Updater()
    updater.add("task", lambda stat: stat)
    return updater


def count_updates(updater: Updater) -> int:
    updater.publisher.publish.reset_mock()  # type: ignore[attr-defined]
    updater.update()
    return int(updater.publisher.publish.call_count)  # type: ignore[attr-defined]


def test_frequency_with_a_clock_that_stands_still() -> None:
    frequency = FrequencyStatus(FrequencyStatusParam({"min": 1, "max": 2}))
    stat = frequency.run(DiagnosticStatusWrapper())
    assert (stat.level, stat.message) == (2, "No events recorded.")
    frequency.tick()
    stat = frequency.run(DiagnosticStatusWrapper())
    assert (stat.level, stat.message) == (1, "Frequency too high.")
    assert {pair.key: pair.value for pair in stat.values}["Actual frequency (Hz)"] == "inf"


def test_updates_go_on_after_the_clock_jumps_back(updater: Updater, clock: type[Clock]) -> None:
    assert count_updates(updater) == 0
    clock.now = 5.0
    assert [count_updates(updater), count_updates(updater)] == [1, 0]
    clock.now = 6.0
    assert count_updates(updater) == 1


def test_period_that_is_not_a_number_is_logged(updater: Updater, clock: type[Clock]) -> None:
    module.rospy.get_param_cached.return_value = "often"  # type: ignore[attr-defined]
    clock.now += 1
    assert count_updates(updater) == 1
    text = module.rospy.logerr_throttle.call_args[0][1]  # type: ignore[attr-defined]
    assert text == "~diagnostic_period is not a number of seconds: 'often'"


def test_composite_takes_tasks_that_return_nothing() -> None:
    several = CompositeDiagnosticTask("several")
    several.addTask(FunctionDiagnosticTask("one", lambda stat: stat.summary(1, "warm")))
    stat = several.run(DiagnosticStatusWrapper())
    assert (stat.level, stat.message) == (1, "warm")


@pytest.mark.parametrize("arguments", [(), (1,), (1, 2, 3)])
def test_summary_that_is_none_is_refused(arguments: tuple[object, ...]) -> None:
    with pytest.raises(TypeError, match="a summary is a DiagnosticStatus, or a level and a message"):
        DiagnosticStatusWrapper().summary(*arguments)  # type: ignore[call-overload]
