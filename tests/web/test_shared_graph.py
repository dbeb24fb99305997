"""The ROS side that clients share: subscriptions that end while they start, and services that end during a call."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
from typing import TYPE_CHECKING, Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import Empty, EmptyResponse, SetBool

from minirospy.core.wire.header import serialize_header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.snapshot import Snapshot
from minirospy.web import graph as shared_graph
from minirospy.web.graph import SharedGraph

if TYPE_CHECKING:
    from tests.web.conftest import Running


@pytest.mark.parametrize("turns", range(4))
def test_publication_closed_while_it_is_registered_ends_cleanly(bridge: Running, turns: int) -> None:
    async def advertise_and_close() -> None:
        graph = bridge.bridge.graph
        publication = graph.advertise("/short", InterfaceType.of(String))
        for _ in range(turns):
            await asyncio.sleep(0)
        publication.close()
        # Raise the tasks' exceptions.
        await asyncio.wait_for(asyncio.gather(*graph.tasks), 30)
        assert "/short" not in graph.node._published

    bridge.run(advertise_and_close())


def test_silent_nodes_do_not_delay_queries_of_others(
    bridge: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("minirospy.web.foxglove.channels.TYPE_SECONDS", 0.1)
    bridge.publisher(bridge.node("talker"), "/chatter", String)
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:
        address = f"127.0.0.1:{silent.getsockname()[1]}"

        async def register() -> None:
            master = bridge.bridge.node.call_master
            for number in range(20):
                uri = f"http://{address}/"
                await master("registerPublisher", f"/t{number}", "odd_msgs/Odd", uri)
                await master("registerService", f"/s{number}", f"rosrpc://{address}", uri)

        bridge.run(register())
        start = time.monotonic()
        client = bridge.client()
        assert client.channel("/chatter")
        assert client.channel("/t19")
        assert client.channels["/t19"]["schemaName"] == "odd_msgs/Odd"
        assert time.monotonic() - start < 100


def test_service_whose_node_answers_late_is_offered(bridge: Running) -> None:
    bridge.publisher(bridge.node("talker"), "/chatter", String)
    may_answer = threading.Event()
    fields = {"callerid": "/late", "type": Empty._type, "md5sum": Empty._md5sum}

    def answer(server: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while True:
                sock, _ = server.accept()
                with sock:
                    may_answer.wait()
                    # The probe may have timed out; in that case there is a second one.
                    with contextlib.suppress(OSError):
                        sock.sendall(serialize_header(fields))
                        sock.recv(4096)

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=answer, args=(server,), daemon=True)
        thread.start()
        address = f"127.0.0.1:{server.getsockname()[1]}"

        async def register() -> None:
            master = bridge.bridge.node.call_master
            await master("registerService", "/late", f"rosrpc://{address}", f"http://{address}/")

        bridge.run(register())
        client = bridge.client()
        # Topics are advertised after the bridge has waited for services.
        assert client.channel("/chatter")
        assert "/late" not in client.services
        may_answer.set()
        assert client.service("/late")


def test_earlier_look_does_not_replace_the_snapshot_of_a_later_one(
    bridge: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    snapshots = [Snapshot(), Snapshot(publishers={"/new": ("/talker",)})]
    is_waiting, may_end = asyncio.Event(), asyncio.Event()

    async def fetch(_: object) -> Snapshot:
        return snapshots.pop(0)

    async def look_up_services(_: object) -> None:
        """Wait for the type of a service in the first refresh."""
        if not is_waiting.is_set():
            is_waiting.set()
            await may_end.wait()

    async def look_twice() -> None:
        graph = SharedGraph(bridge.bridge.node)
        monkeypatch.setattr(graph, "_look_up_services", look_up_services)
        monkeypatch.setattr("minirospy.web.graph.fetch", fetch)
        looks = [asyncio.ensure_future(graph.look())]
        await is_waiting.wait()
        looks.append(asyncio.ensure_future(graph.look()))
        for _ in range(10):
            await asyncio.sleep(0)
        may_end.set()
        await asyncio.gather(*looks)
        assert "/new" in graph.snapshot.publishers
        await graph.close()

    bridge.run(look_twice())


@pytest.mark.parametrize("turns", range(6))
def test_graph_that_is_closed_as_it_is_to_look_again_ends(bridge: Running, turns: int) -> None:
    """Before Python 3.12, asyncio.wait_for swallows the cancellation if the event occurs in the same iteration."""

    async def look_and_close() -> None:
        graph = SharedGraph(bridge.bridge.node, max_refresh_interval=60.0)
        looked = asyncio.Event()
        graph.watch(lambda _: looked.set())
        await looked.wait()
        await asyncio.sleep(0)
        graph.refresh_soon()
        for _ in range(turns):
            await asyncio.sleep(0)
        await asyncio.wait_for(graph.close(), 60)

    bridge.run(look_and_close())


@pytest.mark.parametrize("seen_by", ["check", "call"])
def test_service_offered_again_with_another_type_is_shown_and_called_with_it(
    bridge: Running, monkeypatch: pytest.MonkeyPatch, seen_by: str
) -> None:
    """The node offers it again at once, so no refresh sees the graph without it."""
    monkeypatch.setattr(shared_graph, "CHECK_SECONDS", 0.0 if seen_by == "check" else 1000.0)
    node = bridge.node("again")

    async def offer() -> Any:
        return await node.serve("/switch", Empty, lambda _: EmptyResponse())

    service = bridge.run(offer())
    client, caller = bridge.client(), bridge.rosbridge()
    first = client.service("/switch")
    assert client.services["/switch"]["type"] == "std_srvs/Empty"
    caller.send(op="call_service", service="/switch", id="a")
    assert caller.next("service_response")["result"]

    async def offer_again() -> None:
        await service.close()
        await node.serve("/switch", SetBool, lambda request: (request.data, "new"))

    bridge.run(offer_again())

    def call() -> None:
        caller.send(op="call_service", service="/switch", args={"data": True})
        assert caller.next("service_response")["values"] == {"success": True, "message": "new"}

    if seen_by == "call":
        call()
    while client.services["/switch"]["id"] == first:
        client.next("advertiseServices")
    assert client.services["/switch"]["type"] == "std_srvs/SetBool"
    call()
