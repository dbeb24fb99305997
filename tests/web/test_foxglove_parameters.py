"""Parameter changes that the master reports to the bridge, as clients receive them."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from types import SimpleNamespace
from typing import Any

import pytest

from minirospy.base.errors import RpcRefused
from minirospy.web.foxglove.parameters import Parameters
from minirospy.web.foxglove.protocol import Parameter
from minirospy.web.graph import Filters


class Listener:
    """A client, and the reports that it received."""

    def __init__(self) -> None:
        self.reports: list[list[Parameter]] = []

    def parameters_changed(self, changed: list[Parameter]) -> None:
        self.reports.append(changed)


class Graph:
    """A graph whose master has these parameters; the test runs spawned tasks."""

    filters = Filters()

    def __init__(self, **values: Any) -> None:
        self.values = {f"/{name}": value for name, value in values.items()}
        self.spawned: list[Coroutine[Any, Any, Any]] = []
        watch = SimpleNamespace(listeners=[], add=self._nothing, remove=self._nothing)
        self.node = SimpleNamespace(call_master=self._master, resolve=lambda name: name, parameters=watch)

    def spawn(self, work: Coroutine[Any, Any, Any]) -> None:
        self.spawned.append(work)

    def change(self, name: str, value: object) -> None:
        """Report a change, and finish the tasks that it starts."""

        async def finish() -> None:
            for listener in list(self.node.parameters.listeners):
                listener(name, value)
            while self.spawned:
                await self.spawned.pop(0)

        asyncio.run(finish())

    async def _master(self, _: str, name: str) -> object:
        if name not in self.values:
            raise RpcRefused("getParam", -1, "not set")
        return self.values[name]

    async def _nothing(self, _: str) -> None:
        """Do nothing."""


@pytest.mark.parametrize("names", [("/a",), ("/a", "/other"), ()])
def test_parameter_deletion_is_reported_once(names: tuple[str, ...]) -> None:
    graph, listener = Graph(other=1), Listener()
    Parameters(graph).subscribe(listener, names)  # type: ignore[arg-type]
    graph.change("/a", {})
    assert listener.reports == [[Parameter("/a", is_set=False)]]


def test_empty_namespace_is_not_reported_as_deleted() -> None:
    graph, one, everything = Graph(ns={}), Listener(), Listener()
    parameters = Parameters(graph)  # type: ignore[arg-type]
    parameters.subscribe(one, ("/ns",))
    parameters.subscribe(everything, ())
    graph.change("/ns", {})
    assert one.reports == everything.reports == [[Parameter("/ns", {})]]


def test_parameters_of_a_deleted_namespace_are_each_reported_once() -> None:
    graph, listener = Graph(), Listener()
    Parameters(graph).subscribe(listener, ("/ns/x", "/ns/y", "/ns", "/nsx"))  # type: ignore[arg-type]
    graph.change("/ns", {})
    (report,) = listener.reports
    assert sorted(each.name for each in report) == ["/ns", "/ns/x", "/ns/y"]
    assert not any(each.is_set for each in report)


def test_namespace_above_a_deleted_parameter_is_reported_with_the_rest() -> None:
    graph, listener = Graph(ns={"y": 2}), Listener()
    Parameters(graph).subscribe(listener, ("/ns", "/ns/y"))  # type: ignore[arg-type]
    graph.change("/ns/x", {})
    assert listener.reports == [[Parameter("/ns", {"y": 2})]]


def test_parameters_of_a_master_without_any_are_read_again() -> None:
    graph, one, everything = Graph(), Listener(), Listener()
    parameters = Parameters(graph)  # type: ignore[arg-type]
    parameters.subscribe(one, ("/a",))
    parameters.subscribe(everything, ())
    graph.change("/", {})
    assert one.reports == [[Parameter("/a", is_set=False)]]
    assert everything.reports == []


def test_requests_to_the_master_are_sent_in_order() -> None:
    graph, listener, requests = Graph(), Listener(), []

    async def add(_: str) -> None:
        requests.append("add")

    async def remove(_: str) -> None:
        for _turn in range(10):
            await asyncio.sleep(0)
        requests.append("remove")

    async def run() -> None:
        await asyncio.gather(*graph.spawned)

    graph.node.parameters.add, graph.node.parameters.remove = add, remove
    parameters = Parameters(graph)  # type: ignore[arg-type]
    parameters.subscribe(listener, ())
    parameters.forget(listener)
    parameters.subscribe(listener, ())
    asyncio.run(run())
    assert requests == ["add", "remove", "add"]
