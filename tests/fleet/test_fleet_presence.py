"""Robots that do not respond although their tokens remain: when they count as lost, and when as returned."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from minirospy.fleet.presence import Presence
from tests.manual_loop import ManualLoop, run_manually


class Fleet:
    """Gateways with tokens, some of which respond."""

    def __init__(self) -> None:
        self.tokens: set[str] = {"a", "b"}
        self.answering: set[str] | None = {"a", "b"}
        self.queries = 0
        self.changes = 0
        self.presence = Presence(self._query, lambda: self.tokens, self._changed)

    async def _query(self) -> set[str] | None:
        self.queries += 1
        return self.answering

    def _changed(self) -> None:
        self.changes += 1


def of(scene: Callable[[ManualLoop, Fleet], Coroutine[Any, Any, None]]) -> None:
    async def run(loop: ManualLoop) -> None:
        fleet = Fleet()
        watching = asyncio.ensure_future(fleet.presence.watch())
        try:
            await scene(loop, fleet)
        finally:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)

    run_manually(run)


def test_a_robot_that_does_not_answer_twice_is_lost_until_it_does() -> None:
    async def scene(loop: ManualLoop, fleet: Fleet) -> None:
        await loop.advance(60)
        assert fleet.queries == 1
        fleet.answering = {"a"}
        await loop.advance(60)
        assert fleet.queries == 2
        assert not fleet.presence.lost
        await loop.advance(5)
        assert fleet.presence.lost == {"b"}
        assert (fleet.queries, fleet.changes) == (3, 1)

        # The lost robot is checked more often than the others, with one query each time.
        await loop.advance(10)
        assert (fleet.queries, fleet.changes) == (4, 1)
        fleet.answering = {"a", "b"}
        await loop.advance(10)
        assert not fleet.presence.lost
        assert fleet.changes == 2

    of(scene)


def test_one_missing_answer_is_not_a_loss() -> None:
    async def scene(loop: ManualLoop, fleet: Fleet) -> None:
        fleet.presence.answered("b")
        fleet.answering = {"a"}
        await loop.advance(60)
        fleet.answering = {"b"}
        await loop.advance(5)
        assert fleet.queries == 2
        assert not fleet.changes

    of(scene)


def test_all_are_checked_when_one_has_left() -> None:
    async def scene(loop: ManualLoop, fleet: Fleet) -> None:
        fleet.presence.answered("b")
        fleet.tokens = {"b", "c"}
        fleet.answering = set()
        fleet.presence.check_soon()
        await loop.advance(0)
        await loop.advance(2)
        await loop.advance(5)
        assert fleet.presence.lost == {"b"}, "c has never answered"

        fleet.tokens = {"c"}
        await loop.advance(10)
        assert not fleet.presence.lost

    of(scene)


def test_nothing_is_sent_without_robots() -> None:
    async def scene(loop: ManualLoop, fleet: Fleet) -> None:
        fleet.tokens = set()
        await loop.advance(60)
        assert not fleet.queries

    of(scene)


def test_a_query_that_cannot_be_sent_says_nothing_of_any_robot() -> None:
    async def scene(loop: ManualLoop, fleet: Fleet) -> None:
        fleet.answering = {"a"}
        await loop.advance(60)
        fleet.answering = None
        await loop.advance(60)
        fleet.answering = {"a"}
        for seconds in (60, 5):
            await loop.advance(seconds)
        assert not fleet.presence.lost, "b has never answered"

        # A lost robot stays lost.
        fleet.answering = set()
        for seconds in (60, 5):
            await loop.advance(seconds)
        assert fleet.presence.lost == {"a"}
        fleet.answering = None
        await loop.advance(10)
        assert fleet.presence.lost == {"a"}

    of(scene)
