"""The loop that steps a simulation, with a simulation that only counts."""

from __future__ import annotations

import threading
from typing import Any, cast

import pytest

from minirospy.core.sdf.model import Physics
from minirospy.ros.gazebo_ros.loop import LoopClosed, SimulationLoop
from tests.interruption import ends_elsewhere, interrupt_in_lock


class Counter:
    """Counts steps of 1 ms; the step with the number ``fails_at`` raises an error."""

    def __init__(self, fails_at: int = -1) -> None:
        self.physics = Physics(update_rate=0.0)
        self.steps = 0
        self._fails_at = fails_at

    @property
    def time_ns(self) -> int:
        return self.steps * 1_000_000

    def step(self) -> list[object]:
        self.steps += 1
        if self.steps == self._fails_at:
            raise RuntimeError("broken")
        return []


def loop_of(counter: Counter, **options: Any) -> SimulationLoop:
    return SimulationLoop(cast(Any, counter), **options)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_ctrl_c_at_any_point_of_a_call_leaves_the_loop_running(number: int) -> None:
    loop = loop_of(Counter(), paused=True)
    loop.start()
    interrupt_in_lock(lambda: loop.call(lambda: None), number)
    assert ends_elsewhere(lambda: loop.call(lambda: None))
    assert ends_elsewhere(loop.close)


def test_jobs_run_in_the_loops_thread_while_paused() -> None:
    counter = Counter()
    loop = loop_of(counter, paused=True)
    loop.start()
    assert loop.call(lambda: threading.current_thread().name) == "simulation"
    loop.call(lambda: loop.step(3))
    assert counter.steps == 3
    with pytest.raises(ZeroDivisionError):
        loop.call(lambda: 1 // 0)
    loop.close()
    with pytest.raises(LoopClosed):
        loop.call(lambda: None)
    loop.close()


def test_a_rate_near_zero_waits_and_answers() -> None:
    counter = Counter()
    loop = loop_of(counter)
    loop.set_update_rate(1e-300)
    loop.start()
    for _ in range(50):
        loop.call(lambda: None)
    loop.close()
    assert loop.failure is None


def test_ticks_follow_the_rate_of_simulated_time() -> None:
    counter = Counter()
    loop = loop_of(counter, tick_rate=100.0)
    ticks: list[int] = []
    ended = threading.Event()
    loop.on_tick = lambda: ticks.append(counter.steps)
    loop.start()
    loop.end_after(50, ended.set)
    assert ended.wait(30)
    loop.close()
    assert counter.steps >= 50
    assert ticks[:4] == [0, 10, 20, 30]


def test_jobs_run_between_two_ticks_if_a_step_is_tiny() -> None:
    counter = Counter()
    counter.physics = Physics(step=1e-12, update_rate=0.0)
    loop = loop_of(counter)
    loop.start()
    ended = threading.Event()
    threading.Thread(target=lambda: loop.call(ended.set), daemon=True).start()
    assert ended.wait(20)
    loop.close()


def test_a_call_after_the_end_is_refused() -> None:
    loop = loop_of(Counter())
    loop.start()
    loop.close()
    with pytest.raises(LoopClosed):
        loop.call(lambda: None)


def test_a_failure_ends_the_loop_and_its_jobs() -> None:
    failed: list[Exception] = []
    loop = loop_of(Counter(fails_at=5))
    loop.on_failure = failed.append
    loop.start()

    def call_until_closed() -> None:
        while True:
            loop.call(lambda: None)

    with pytest.raises(LoopClosed):
        call_until_closed()
    loop.close()
    assert loop.failure is failed[0]
    assert str(failed[0]) == "broken"
