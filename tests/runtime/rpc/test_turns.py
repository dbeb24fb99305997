"""runtime/rpc/turns: long work in short slices, with a clock that the test controls."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator

import pytest

from minirospy.base.steps import ALONE, PAUSE, Need, Steps, finish, is_small
from minirospy.runtime.rpc.turns import Turns
from tests.waiting import until


class Clock:
    """A clock that advances by one at each step."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def work(clock: Clock, name: str, steps: int, done: list[str], *needs: Need) -> Steps[None]:
    yield from needs
    for number in range(steps):
        clock.now += 1.0
        done.append(f"{name}{number}")
        yield None


async def turn(count: int = 1) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


def run(scene: Callable[[Turns, Clock, list[str]], Iterator[int]], seconds: float = 3.0) -> None:
    async def main() -> None:
        clock = Clock()
        turns = Turns(seconds, clock)
        for count in scene(turns, clock, []):
            await turn(count)
        turns.close()

    asyncio.run(main())


def test_a_turn_of_the_loop_runs_a_few_steps() -> None:
    def scene(turns: Turns, clock: Clock, done: list[str]) -> Iterator[int]:
        turns.start(work(clock, "a", 10, done))
        assert done == []
        for expected in (3, 6, 9, 10):
            yield 1
            assert len(done) == expected
        assert not turns

    run(scene)


def test_work_side_by_side_has_equal_shares() -> None:
    def scene(turns: Turns, clock: Clock, done: list[str]) -> Iterator[int]:
        for name in "abc":
            turns.start(work(clock, name, 9, done))
        yield 3
        assert sorted(done) == sorted(f"{name}{number}" for name in "abc" for number in range(3))
        yield 7
        assert len(done) == 27
        assert not turns

    run(scene)


def test_short_work_shares_a_turn() -> None:
    def scene(turns: Turns, clock: Clock, done: list[str]) -> Iterator[int]:
        for name in "abcd":
            turns.start(work(clock, name, 1, done))
        yield 1
        assert done == ["a0", "b0", "c0"]
        yield 1
        assert done[3:] == ["d0"]

    run(scene)


def test_much_work_starts_some_at_a_time() -> None:
    def scene(turns: Turns, clock: Clock, done: list[str]) -> Iterator[int]:
        for number in range(50):
            turns.start(work(clock, f"{number}-", 3, done))
        yield 17
        assert {name.split("-")[0] for name in done} <= {str(number) for number in range(18)}
        yield 60
        assert len(done) == 150
        assert not turns

    run(scene)


def test_work_that_takes_much_memory_runs_alone_among_its_like() -> None:
    def scene(turns: Turns, clock: Clock, done: list[str]) -> Iterator[int]:
        turns.start(work(clock, "a", 6, done, ALONE))
        turns.start(work(clock, "b", 6, done, ALONE))
        turns.start(work(clock, "c", 6, done))
        yield 20
        order = [name[0] for name in done]
        assert len(order) == 18
        assert "".join(letter for letter in order if letter != "c") == "a" * 6 + "b" * 6
        assert order.index("c") < 6

    run(scene)


def test_cancelled_work_lets_the_next_one_go_on() -> None:
    def scene(turns: Turns, clock: Clock, done: list[str]) -> Iterator[int]:
        first, second, third = (work(clock, name, 100, done, ALONE) for name in "abc")
        for each in (first, second, third):
            turns.start(each)
        yield 2
        assert {name[0] for name in done} == {"a"}
        turns.cancel(second)
        turns.cancel(first)
        done.clear()
        yield 2
        assert {name[0] for name in done} == {"c"}
        turns.cancel(third)
        turns.cancel(third)
        assert not turns

    run(scene)


def test_a_fault_ends_one_piece_of_work(caplog: pytest.LogCaptureFixture) -> None:
    def fail() -> Steps[None]:
        yield None
        raise ZeroDivisionError

    def scene(turns: Turns, clock: Clock, done: list[str]) -> Iterator[int]:
        turns.start(fail())
        turns.start(work(clock, "a", 3, done))
        yield 3
        assert done == ["a0", "a1", "a2"]
        assert not turns

    with caplog.at_level(logging.ERROR):
        run(scene)
    assert "fault in a long piece of work" in caplog.text


def test_work_that_waits_does_not_hold_up_the_rest() -> None:
    is_ready = False

    def wait(done: list[str]) -> Steps[None]:
        while not is_ready:
            yield PAUSE
        done.append("ready")

    async def main() -> None:
        nonlocal is_ready
        clock, done = Clock(), list[str]()
        turns = Turns(3.0, clock)
        turns.start(wait(done))
        turns.start(work(clock, "a", 30, done))
        await turn(15)
        assert len(done) == 30
        is_ready = True
        await until(lambda: not turns)
        assert done[-1] == "ready"

    asyncio.run(main())


def test_finish_returns_the_result() -> None:
    def double(value: int) -> Steps[int]:
        yield None
        yield ALONE
        return 2 * value

    assert finish(double(4)) == 8


@pytest.mark.parametrize(
    ("value", "small"),
    [
        (5, True),
        ([1, "text", ["http://x:1/"] * 50], True),
        (list(range(1990)), True),
        (list(range(2001)), False),
        ([[1] * 1000] * 3, False),
        ("x" * 31_000, True),
        ("x" * 33_000, False),
        ({"x" * 33_000: 1}, False),
        ({f"{number}": number for number in range(3000)}, False),
        (b"x" * 100_000, False),
    ],
)
def test_what_is_small(value: object, small: bool) -> None:
    assert is_small(value) is small
