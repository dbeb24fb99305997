"""A master whose registrations are nearly full unregisters nodes that refuse connections, and no others."""

from __future__ import annotations

import asyncio
import socket

import pytest

from minirospy.core.graph.registry import Registry
from minirospy.core.graph.shares import Shares
from minirospy.runtime.master import dead_nodes
from minirospy.runtime.master import master as masters
from minirospy.runtime.master.master import Master
from minirospy.runtime.rpc.server import RpcServer
from tests.conftest import free_port
from tests.waiting import until


def test_a_crowded_master_forgets_nodes_that_refuse_connections(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(masters, "SWEEP_SECONDS", 0.01)
    monkeypatch.setattr(dead_nodes, "SILENCE_SECONDS", 0.1)
    called: list[str] = []
    publishers: list[object] = []

    def answer(method: str, args: list[object]) -> object:
        called.append(method)
        if method == "publisherUpdate":
            publishers[:] = args[2]  # type: ignore[call-overload]
        return [1, "", 0]

    async def scene() -> None:
        master = Master(same_host=False)
        master.registry = Registry(Shares(100_000, 100_000, 50_000, 1000))
        await master.start()
        live = RpcServer(answer)
        await live.start()
        with socket.create_server(("127.0.0.1", 0)) as slow:
            live_uri, slow_uri = (
                f"http://127.0.0.1:{live.port}/",
                f"http://127.0.0.1:{slow.getsockname()[1]}/",
            )
            dead_uri = f"http://127.0.0.1:{free_port()}/"
            master.dispatch("registerSubscriber", ["/live", "/t0", "a/B", live_uri])
            master.dispatch("registerPublisher", ["/slow", "/t0", "a/B", slow_uri])
            master.dispatch("registerPublisher", ["/dead", "/t0", "a/B", dead_uri])
            for number in range(10):
                master.dispatch("registerPublisher", [f"/dead{number}", f"/t{number}", "a/B", dead_uri])
            await until(lambda: publishers == [slow_uri, dead_uri, dead_uri])
            await asyncio.sleep(0.05)
            # There is enough space, so the master calls no nodes.
            assert len(master.registry.nodes()) == 13
            assert "getPid" not in called

            for number in range(10, 100):
                master.dispatch("registerPublisher", [f"/dead{number}", f"/t{number}", "a/B", dead_uri])
            assert master.registry.is_crowded
            await until(lambda: len(master.registry.nodes()) == 2)
            assert master.registry.nodes() == {"/live": live_uri, "/slow": slow_uri}
            assert master.registry.publishers() == {"/t0": ["/slow"]}
            await until(lambda: publishers == [slow_uri])
        await live.close()
        await master.close()

    asyncio.run(scene())
