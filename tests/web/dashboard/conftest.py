"""A dashboard on a loop in the test, and requests with real sockets."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterator
from http.client import HTTPConnection, HTTPResponse
from typing import Any, TypeVar

import pytest

from minirospy import Node
from minirospy.runtime.transport.loop import LoopThread
from minirospy.web.access import Access
from minirospy.web.bridge import BridgeOptions
from minirospy.web.dashboard.dashboard import Dashboard

_T = TypeVar("_T")
TOKEN = "owner-token-0"


class Served:
    """A running dashboard, and other nodes in the same graph."""

    def __init__(self, options: BridgeOptions) -> None:
        self.loop = LoopThread("test-dashboard")
        self.nodes: list[Node] = []
        self._options = options
        self.dashboard: Dashboard | None = None

    def start(self) -> None:
        self.dashboard = self.run(self._start())

    @property
    def port(self) -> int:
        assert self.dashboard
        return self.dashboard.port

    @property
    def node_of_dashboard(self) -> Node:
        return self.nodes[0]

    def run(self, work: Coroutine[object, object, _T]) -> _T:
        return self.loop.run(work, 200.0)

    def node(self, name: str) -> Node:
        async def start() -> Node:
            node = Node(name)
            await node.start()
            self.nodes.append(node)
            return node

        return self.run(start())

    def request(self, path: str, **headers: str) -> tuple[HTTPResponse, bytes]:
        connection = HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request(
                "GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()}
            )
            answer = connection.getresponse()
            return answer, answer.read()
        finally:
            connection.close()

    def close(self) -> None:
        try:
            self.run(self._close())
        finally:
            self.loop.close()

    async def _start(self) -> Dashboard:
        node = Node("dashboard", rosout=False)
        await node.start()
        self.nodes.append(node)
        dashboard = Dashboard(node, self._options)
        await dashboard.start()
        return dashboard

    async def _close(self) -> None:
        if self.dashboard:
            await self.dashboard.close()
        for node in reversed(self.nodes):
            await node.close()


@pytest.fixture
def serve(master: str) -> Iterator[Callable[..., Served]]:
    """Return a function that starts a dashboard with these options on a free port."""
    started: list[Served] = []

    def start(**options: Any) -> Served:
        options.setdefault("access", Access(write_token=TOKEN))
        started.append(Served(BridgeOptions(foxglove_port=0, diagnostics=False, **options)))
        started[-1].start()
        return started[-1]

    yield start
    for each in started:
        each.close()
