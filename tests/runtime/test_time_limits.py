"""The time limits that docs/master.md and docs/network.md state, with a clock that the test controls."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.core.graph.registry import PublisherUpdate
from minirospy.core.wire.http import serialize_request
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.core.wire.xmlrpc import serialize_call
from minirospy.runtime.master.master import Master
from minirospy.runtime.master.notifier import Notifier
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.rpc.turns import Turns
from tests.manual_loop import ManualLoop, run_manually, until

STRING = InterfaceType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")
LARGE = 60_000_000  # bytes, more than the system buffers for a client that does not read


@pytest.fixture(autouse=True)
def _tcp_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Connect by TCP only, because the tests count connections."""
    monkeypatch.setenv("MINIROSPY_TRANSPORT", "tcp")


def is_open(sock: socket.socket) -> bool:
    """Return whether the peer has not closed the connection, after reading the data that it has sent."""
    try:
        while sock.recv(1 << 20):
            pass
    except BlockingIOError:
        return True
    except ConnectionResetError:
        pass
    return False


# --- requests and answers (docs/master.md: 30 s, 64 KiB)


def call(text: str) -> bytes:
    return serialize_request("localhost", "/", serialize_call("echo", [text]))


@contextlib.asynccontextmanager
async def served() -> AsyncIterator[tuple[RpcServer, socket.socket]]:
    """Yield a server whose responses are all large, and the socket of a client."""

    def answer(method: str, args: Sequence[Any]) -> str:
        return "x" * LARGE

    server = RpcServer(answer)
    await server.start()
    with socket.create_connection(("127.0.0.1", server.port)) as client:
        client.setblocking(False)
        await until(lambda: server.clients == 1)
        yield server, client
    await server.close()


def test_request_must_be_whole_within_30_seconds() -> None:
    async def scene(clock: ManualLoop) -> None:
        async with served() as (server, client):
            client.send(call("half of it")[:-20])
            await until(lambda: len(server.deadlines))
            await clock.advance(29.9)
            assert is_open(client)
            # A little more of the request does not extend the limit.
            client.send(b"x")
            await until(lambda: server.clients == 1)
            await clock.advance(0.2)
            await until(lambda: not is_open(client))
            assert server.clients == 0

    run_manually(scene)


def test_request_that_brings_64_kib_in_30_seconds_goes_on() -> None:
    async def scene(clock: ManualLoop) -> None:
        async with served() as (server, client):
            request = call("x" * 1_000_000)
            client.send(request[:100])
            await until(lambda: len(server.deadlines))
            for start in range(100, 400_000, 100_000):
                await clock.advance(29.9)
                held = server.held
                client.send(request[start : start + 100_000])
                await until(lambda held=held: server.held >= held + 90_000)
            await clock.advance(29.9)
            assert is_open(client)
            await clock.advance(0.2)
            await until(lambda: not is_open(client))

    run_manually(scene)


def test_idle_connection_stays_open() -> None:
    async def scene(clock: ManualLoop) -> None:
        async with served() as (server, client):
            await clock.advance(10_000.0)
            assert is_open(client)
            assert server.clients == 1

    run_manually(scene)


def test_answer_must_be_read_within_30_seconds() -> None:
    async def scene(clock: ManualLoop) -> None:
        async with served() as (server, client):
            client.send(call("much, please"))
            await until(lambda: len(server.deadlines))
            await clock.advance(29.9)
            assert server.clients == 1
            await clock.advance(0.2)
            assert server.clients == 0

    run_manually(scene)


def test_answer_of_which_64_kib_are_read_in_30_seconds_goes_on() -> None:
    async def scene(clock: ManualLoop) -> None:
        async with served() as (server, client):
            client.send(call("much, please"))
            await until(lambda: len(server.deadlines))
            got = 0
            for _ in range(3):
                await clock.advance(29.9)
                goal = got + 10_000_000
                while got < goal:
                    with contextlib.suppress(BlockingIOError):
                        got += len(client.recv(65536))
                    await asyncio.sleep(0)
                assert server.clients == 1
            # The data read last may have made space for more.
            for _ in range(3):
                await clock.advance(30.1)
            assert server.clients == 0

    run_manually(scene)


# --- the notifier (docs/master.md: 20 ms, 20 to 30 ms)


class Graph:
    """A graph in which every topic has one publisher, and which has no parameters."""

    def publisher_uris(self, topic: str) -> list[str]:
        return ["http://x:1/"]

    def parameter(self, key: str) -> Any:
        return {}

    def subscribed_parameters(self, uri: str) -> list[str]:
        return []


def test_update_soon_after_a_registration_is_delayed_20_to_30_ms() -> None:
    async def scene(clock: ManualLoop) -> None:
        notified: list[float] = []
        for fraction in range(10):
            notified.clear()
            notifier = Notifier(Graph(), Turns(), 5.0)
            notifier.here["http://n:1/"] = lambda topic, uris: notified.append(clock.time())
            # The response arrives at any time between two ticks of the clock.
            await clock.advance(0.001 * fraction)
            registered = clock.time()
            notifier.defer("http://n:1/", "/t")
            await clock.advance(0.0195)
            notifier.send(PublisherUpdate("http://n:1/", "/t"))
            while not notified:
                await clock.advance(0.0005)
            # This is one tick more, because a timer may fire early by the clock's resolution.
            assert 0.02 <= notified[0] - registered < 0.032
            await notifier.close()

    run_manually(scene)


def test_update_after_the_pause_or_of_another_topic_is_sent_immediately() -> None:
    async def scene(clock: ManualLoop) -> None:
        notified: list[str] = []
        notifier = Notifier(Graph(), Turns(), 5.0)
        notifier.here["http://n:1/"] = lambda topic, uris: notified.append(topic)
        notifier.defer("http://n:1/", "/t")
        notifier.send(PublisherUpdate("http://n:1/", "/other"))
        await clock.advance(0.0)
        assert notified == ["/other"]
        await clock.advance(0.031)
        notifier.send(PublisherUpdate("http://n:1/", "/t"))
        await clock.advance(0.0)
        assert notified == ["/other", "/t"]
        await notifier.close()

    run_manually(scene)


# --- nodes of a master that was killed (docs/master.md: three times within 3 s)


class SilentNode:
    """A node's API that accepts calls but never responds."""

    def __init__(self) -> None:
        self.calls = 0
        self._server = socket.create_server(("127.0.0.1", 0))
        self._server.setblocking(False)
        self._peers: list[socket.socket] = []
        self.uri = f"http://127.0.0.1:{self._server.getsockname()[1]}/"
        asyncio.get_running_loop().add_reader(self._server, self._accept)

    def _accept(self) -> None:
        self._peers.append(self._server.accept()[0])
        self.calls += 1

    def close(self) -> None:
        asyncio.get_running_loop().remove_reader(self._server)
        for sock in (*self._peers, self._server):
            sock.close()


def test_recovered_node_is_forgotten_after_three_calls_of_3_seconds(tmp_path: Path) -> None:
    async def scene(clock: ManualLoop) -> None:
        node = SilentNode()
        killed = Master(journal=tmp_path / "journal")
        await killed.start()
        assert killed.dispatch("registerPublisher", ["/n", "/t", "std_msgs/String", node.uri])[0] == 1
        await killed.close(keep_journal=True)

        master = Master(journal=tmp_path / "journal")
        await master.start()
        for count in (1, 2, 3):
            await until(lambda count=count: node.calls == count)
            await clock.advance(2.9)
            assert (node.calls, list(master.registry.nodes())) == (count, ["/n"])
            await clock.advance(0.2)
        await until(lambda: not master.registry.nodes())
        assert node.calls == 3
        await master.close()
        node.close()

    run_manually(scene)


# --- nodes (docs/network.md: 10 s)


@contextlib.asynccontextmanager
async def graph(*names: str) -> AsyncIterator[tuple[Master, list[Node]]]:
    master = Master(host="127.0.0.1")
    await master.start()
    environment = Environment.read(
        {"ROS_MASTER_URI": f"http://127.0.0.1:{master.port}", "ROS_IP": "127.0.0.1"}
    )
    nodes = [Node(name, environment) for name in names]
    for node in nodes:
        await node.start()
    try:
        yield master, nodes
    finally:
        for node in nodes:
            await node.close()
        await master.close()


def test_silent_connection_is_closed_after_10_seconds(caplog: pytest.LogCaptureFixture) -> None:
    async def scene(clock: ManualLoop) -> None:
        async with graph("/n") as (_, (node,)):
            with socket.create_connection(("127.0.0.1", node.tcpros_port)) as peer:
                peer.setblocking(False)
                await until(lambda: node.listener.handshakes)
                await clock.advance(9.9)
                assert is_open(peer)
                await clock.advance(0.2)
                await until(lambda: not is_open(peer))

    caplog.set_level(logging.WARNING)
    run_manually(scene)
    assert "timed out waiting for a connection header" in caplog.text


@pytest.mark.parametrize(("seconds", "is_kept"), [(9.9, True), (10.1, False)])
def test_lists_of_a_new_master_drop_no_connection_for_10_seconds(seconds: float, is_kept: bool) -> None:
    async def scene(clock: ManualLoop) -> None:
        async with graph("/a", "/b") as (_, (a, b)):
            await a.advertise(Publication("/t", STRING))
            subscription = b.make_subscription("/t", STRING, lambda *_: None)
            await b.subscribe(subscription)
            await until(lambda: subscription.links)
            # The master has restarted, and this node registers before the publisher.
            subscription.registered_again([])
            subscription.publishers_changed([a.uri])
            await clock.advance(seconds)
            subscription.publishers_changed([])
            assert bool(subscription.links) is is_kept

    run_manually(scene)
