"""runtime/transport/deadlines: a single loop timer for the time limits of many operations."""

from __future__ import annotations

from minirospy.runtime.transport.deadlines import Deadlines
from tests.manual_loop import ManualLoop, run_manually


def test_deadlines_end_one_after_the_other() -> None:
    async def scene(loop: ManualLoop) -> None:
        late: list[str] = []
        deadlines: Deadlines[str] = Deadlines(late.append)
        deadlines.set("long", 60.0)
        deadlines.set("third", 0.5)
        deadlines.set("first", 0.1)
        deadlines.set("in time", 0.1)
        deadlines.set("second", 0.1)
        deadlines.set("second", 0.3)
        deadlines.drop("in time")
        assert list(deadlines) == ["long", "third", "first", "second"]

        expected: list[str] = []
        for name in ("first", "second", "third"):
            await loop.advance(0.15)
            expected.append(name)
            assert late == expected
            await loop.advance(0.04)
            assert late == expected

        assert list(deadlines) == ["long"]
        deadlines.close()
        await loop.advance(100.0)
        assert late == expected

    run_manually(scene)


def test_deadlines_that_pass_in_one_stall_come_in_the_order_of_their_ends() -> None:
    async def scene(loop: ManualLoop) -> None:
        late: list[str] = []
        deadlines: Deadlines[str] = Deadlines(late.append)
        for name, seconds in (
            ("third", 0.5),
            ("first", 0.1),
            ("fourth", 0.5),
            ("second", 0.3),
            ("later", 9.0),
        ):
            deadlines.set(name, seconds)
        await loop.advance(5.0)
        assert late == ["first", "second", "third", "fourth"]
        assert list(deadlines) == ["later"]

    run_manually(scene)


def test_a_deadline_dropped_by_the_end_of_another_is_not_late() -> None:
    async def scene(loop: ManualLoop) -> None:
        late: list[str] = []

        def end(name: str) -> None:
            late.append(name)
            deadlines.drop("second")

        deadlines: Deadlines[str] = Deadlines(end)
        deadlines.set("first", 0.1)
        deadlines.set("second", 0.2)
        await loop.advance(1.0)
        assert late == ["first"]

    run_manually(scene)


def test_a_deadline_set_again_by_the_end_of_another_is_not_late() -> None:
    async def scene(loop: ManualLoop) -> None:
        late: list[str] = []

        def end(name: str) -> None:
            late.append(name)
            if name == "first":
                deadlines.set("second", 10.0)

        deadlines: Deadlines[str] = Deadlines(end)
        deadlines.set("first", 0.1)
        deadlines.set("second", 0.2)
        await loop.advance(1.0)
        assert late == ["first"]
        await loop.advance(10.0)
        assert late == ["first", "second"]

    run_manually(scene)
