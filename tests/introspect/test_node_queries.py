"""Queries to nodes: each node is queried once, and nodes that do not respond do not delay others."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

import pytest

from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import BridgeError, ServiceException
from minirospy.introspect import node_queries
from minirospy.introspect.node_queries import MAX_CONCURRENT, NodeQueries
from tests.manual_loop import ManualLoop, run_manually
from tests.waiting import until

LIMIT = 60.0


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the time limit for silent nodes. A test of the limit sets it after this fixture."""
    for name in ("QUERY_SECONDS", "AGAIN_SECONDS", "REFUSED_SECONDS"):
        monkeypatch.setattr(node_queries, name, LIMIT)


class Nodes:
    """Nodes that respond with their name in capitals. Those in ``silent`` respond when released, those in ``dead`` never."""

    def __init__(self) -> None:
        self.queried: list[str] = []
        self.silent: set[str] = set()
        self.dead: set[str] = set()
        self.may_answer = asyncio.Event()
        self.came_late = asyncio.Event()

    async def answer(self, name: str) -> str:
        self.queried.append(name)
        if name in self.dead:
            raise BridgeError(f"{name} is dead")
        if name in self.silent:
            await self.may_answer.wait()
        return name.upper()


def queried(scene: Callable[[Nodes, NodeQueries[str, str]], Awaitable[None]]) -> None:
    """Run a scene with nodes and queries to them."""

    async def run() -> None:
        nodes = Nodes()
        reporter = ErrorReporter(logging.getLogger("test"), "the query")
        queries = NodeQueries(nodes.answer, reporter, arrived_late=nodes.came_late.set)
        try:
            await asyncio.wait_for(scene(nodes, queries), LIMIT)
        finally:
            await queries.close()
        assert not queries.tasks

    asyncio.run(run())


def test_each_node_is_queried_once_and_forgotten_when_it_has_gone() -> None:
    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        await queries.look(["a", "b"], LIMIT)
        await queries.look(["a", "b"], LIMIT)
        assert queries.found == {"a": "A", "b": "B"}
        assert nodes.queried == ["a", "b"]
        await queries.look(["b"], LIMIT)
        assert queries.found == {"b": "B"}
        await queries.look(["a", "b"], LIMIT)
        assert nodes.queried == ["a", "b", "a"]

    queried(scene)


def test_a_node_that_hangs_is_queried_once_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_queries, "AGAIN_SECONDS", 0.0)

    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        nodes.silent.add("a")
        for _ in range(5):
            await queries.look(["a"], 0.0)
        await until(lambda: nodes.queried)
        assert nodes.queried == ["a"]
        nodes.may_answer.set()
        await until(lambda: queries.found)
        assert nodes.queried == ["a"]

    queried(scene)


def test_unexpected_answer_is_reported() -> None:
    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        nodes.silent.add("late")
        await queries.look(["soon"], LIMIT)
        assert queries.found == {"soon": "SOON"}
        await queries.look(["late", "soon"], 0.0)
        assert not nodes.came_late.is_set()
        nodes.may_answer.set()
        await nodes.came_late.wait()
        assert queries.found == {"late": "LATE", "soon": "SOON"}

    queried(scene)


def test_answer_of_a_removed_node_is_discarded() -> None:
    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        nodes.silent.add("moved")
        await queries.look(["moved"], 0.0)
        await until(lambda: nodes.queried)
        await queries.look([], 0.0)
        nodes.may_answer.set()
        await until(lambda: not queries.tasks)
        assert not queries.found

        nodes.dead.add("moved")
        await queries.look(["moved"], LIMIT)
        assert nodes.queried == ["moved", "moved"], "it is as new as at first"

    queried(scene)


def test_an_answer_after_a_look_that_was_cancelled_is_reported() -> None:
    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        nodes.silent.add("late")
        looking = asyncio.ensure_future(queries.look(["late"], LIMIT))
        await until(lambda: nodes.queried)
        looking.cancel()
        await asyncio.gather(looking, return_exceptions=True)
        nodes.may_answer.set()
        await nodes.came_late.wait()

    queried(scene)


def test_a_node_that_failed_is_queried_again_after_a_pause() -> None:
    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        nodes.dead.add("a")
        await queries.look(["a"], LIMIT)
        await queries.look(["a"], LIMIT)
        await until(lambda: not queries.tasks)
        assert nodes.queried == ["a"]
        queries.not_before["a"] -= node_queries.AGAIN_SECONDS
        nodes.dead.clear()
        await queries.look(["a"], LIMIT)
        await until(lambda: queries.found)
        assert nodes.queried == ["a", "a"]

    queried(scene)


def test_a_node_that_refuses_is_queried_again_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_queries, "REFUSED_SECONDS", 0.5)
    monkeypatch.setattr(node_queries, "AGAIN_SECONDS", 10.0)

    async def scene(loop: ManualLoop) -> None:
        nodes = Nodes()
        queries = NodeQueries(nodes.answer, ErrorReporter(logging.getLogger("test"), "the query"))
        nodes.dead.add("a")
        nodes.silent.add("b")
        await queries.look(["a"], 0.0)
        await loop.advance(0)
        nodes.dead.clear()
        await loop.advance(0.5)
        await queries.look(["a"], 0.0)
        await loop.advance(0)
        assert queries.found == {"a": "A"}

        # Many nodes that refuse connections are not queried more often than silent ones.
        dead = [f"dead{number}" for number in range(1000)]
        nodes.dead.update(dead)
        await queries.look(dead, 0.0)
        await loop.advance(0)
        await loop.advance(0.5)
        before = len(nodes.queried)
        await queries.look(dead, 0.0)
        await loop.advance(0)
        assert len(nodes.queried) - before < 100
        await queries.close()

    run_manually(scene)


def test_a_query_that_takes_too_long_has_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_queries, "QUERY_SECONDS", 0.0)

    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        nodes.silent.add("a")
        await queries.look(["a"], LIMIT)
        assert "a" in queries.not_before

    queried(scene)


def test_many_nodes_that_do_not_answer_keep_a_new_one_waiting_for_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(node_queries, "AGAIN_SECONDS", 0.0)

    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        dead = [f"dead{number}" for number in range(3 * MAX_CONCURRENT)]
        nodes.dead.update(dead)
        await queries.look(dead, LIMIT)
        nodes.dead.clear()
        nodes.silent.update(dead)
        await queries.look(dead, LIMIT)
        await queries.look([*dead, "new"], LIMIT)
        assert queries.found == {"new": "NEW"}

    queried(scene)


def test_unexpected_error_of_one_node_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        async def answer(name: str) -> str:
            if name == "odd":
                raise KeyError("it")
            return name

        queries = NodeQueries(answer, ErrorReporter(logging.getLogger("test"), "the query"))
        await queries.look(["odd", "even"], LIMIT)
        assert queries.found == {"even": "even"}
        await queries.close()

    asyncio.run(asyncio.wait_for(run(), LIMIT))
    assert "the query failed at" in caplog.text


def test_a_service_that_cannot_be_reached_is_not_reported(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        async def answer(name: str) -> str:
            raise ServiceException(f"service [{name}] cannot be reached")

        queries = NodeQueries(answer, ErrorReporter(logging.getLogger("test"), "the query"))
        await queries.look(["/dead"], LIMIT)
        assert "/dead" in queries.not_before
        await queries.close()

    asyncio.run(asyncio.wait_for(run(), LIMIT))
    assert not caplog.text


def test_a_refreshed_key_keeps_its_result_until_a_new_one_arrives() -> None:
    async def scene(nodes: Nodes, queries: NodeQueries[str, str]) -> None:
        await queries.look(["a"], LIMIT)
        queries.refresh("unknown")
        queries.refresh("a")
        await until(lambda: not queries.tasks)
        assert not nodes.came_late.is_set()  # nothing has changed

        nodes.dead.add("a")
        queries.refresh("a")
        await until(lambda: not queries.tasks)
        assert queries.found == {"a": "A"}

        nodes.dead.clear()
        queries.found["a"] = "old"
        queries.refresh("a")
        assert queries.found == {"a": "old"}
        await nodes.came_late.wait()
        assert queries.found == {"a": "A"}

    queried(scene)
