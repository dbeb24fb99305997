"""Rates, bandwidth and delays, with times that the test controls."""

from __future__ import annotations

import math
import statistics

from minirospy.introspect.rates import (
    Bandwidth,
    BandwidthWindow,
    DelayWindow,
    RateWindow,
    Spread,
    bandwidth_text,
    rate_text,
)


def test_a_rate_needs_two_messages_and_something_new() -> None:
    window = RateWindow()
    assert window.report() is None
    window.add(10.0)
    assert window.report() is None
    window.add(10.5)
    report = window.report()
    assert report is not None
    assert (report.rate, report.min, report.max, report.std_dev, report.window) == (2.0, 0.5, 0.5, 0.0, 2)
    assert window.report() is None


def test_a_rate_is_that_of_the_window() -> None:
    window = RateWindow(3)
    for time in (0.0, 9.0, 10.0, 11.5):
        window.add(time)
    report = window.report()
    assert report is not None
    assert (report.mean, report.min, report.max, report.window) == (1.25, 1.0, 1.5, 3)
    assert math.isclose(report.std_dev, statistics.pstdev([1.0, 1.5]))


def test_time_that_is_set_back_restarts_the_window() -> None:
    window = RateWindow()
    for time in (100.0, 101.0, 5.0, 5.25):
        window.add(time)
    report = window.report()
    assert report is not None
    assert report.rate == 4.0


def test_bandwidth() -> None:
    window = BandwidthWindow(2)
    window.add(0.0, 1000)
    assert window.report(1.0) is None
    window.add(1.0, 10)
    window.add(2.0, 30)
    report = window.report(3.0)
    assert report is not None
    assert (report.rate, report.mean, report.min, report.max, report.window) == (20.0, 20.0, 10, 30, 2)


def test_delay() -> None:
    window = DelayWindow()
    assert window.report() is None
    window.add(10.5, 10.0)
    window.add(11.25, 11.0)
    report = window.report()
    assert report is not None
    assert (report.mean, report.min, report.max, report.window) == (0.375, 0.25, 0.5, 2)
    assert window.report() is None


def test_several_topics_make_a_table() -> None:
    spread = Spread(0.05, 0.04897, 0.05128, 0.0002319, 60)
    assert rate_text({"/fast": spread, "/slow": None}) == (
        "topic   rate   min_delta   max_delta    std_dev    window\n"
        "=========================================================\n"
        "/fast   20.0   0.04897     0.05128     0.0002319   60    \n"
    )
    assert rate_text({"/a": None, "/b": None}) == rate_text({"/a": None}) == "no new messages"
    wide = Bandwidth(2.5e6, 1000.0, 900, 1100, 7)
    assert bandwidth_text({"/a": wide}) == (
        "average: 2.50MB/s\n\tmean: 0.00MB min: 0.00MB max: 0.00MB window: 7"
    )
    assert bandwidth_text({"/a": None}) == ""
    assert bandwidth_text({"/a": wide, "/b": Bandwidth(10.0, 5.0, 5, 5, 2)}).splitlines()[2:] == [
        "/a      2.50MB/s    0.00MB   0.00MB   0.00MB   7     ",
        "/b      10.00B/s    5.00B    5.00B    5.00B    2     ",
    ]
