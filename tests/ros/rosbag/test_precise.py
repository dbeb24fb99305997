"""Waiting until a point in time."""

from __future__ import annotations

import threading
import time

from minirospy.ros.rosbag.recording.precise import PreciseWait

HOUR = 3600 * 10**9


def test_it_returns_when_the_time_has_come() -> None:
    wait = PreciseWait()
    for milliseconds in (0, 1, 7, 20):
        target = time.perf_counter_ns() + milliseconds * 1_000_000
        assert wait.until(target) >= target


def test_a_time_that_is_past_is_not_waited_for() -> None:
    assert PreciseWait().until(0) > 0


def test_wake_ends_a_long_wait() -> None:
    wait = PreciseWait()
    threading.Timer(0.05, wait.wake).start()
    end = time.perf_counter_ns() + HOUR

    assert wait.until(end) < end


def test_wake_before_the_wait_counts_once() -> None:
    wait = PreciseWait()
    wait.wake()
    end = time.perf_counter_ns() + HOUR

    assert wait.until(end) < end
    target = time.perf_counter_ns() + 20_000_000
    assert wait.until(target) >= target
