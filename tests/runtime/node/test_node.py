"""runtime/node/node and runtime/node/slave: a node's responses to its peers, and the address that it advertises."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Generator
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import RpcFault
from minirospy.base.steps import finish
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node import node as node_module
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.node.slave import SlaveApi
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.transport import tcp
from minirospy.runtime.transport.loop import new_event_loop

NO_MASTER = {"ROS_MASTER_URI": "http://127.0.0.1:1", "ROS_IP": "127.0.0.1"}


def run(scene: Callable[[], Coroutine[Any, Any, None]]) -> None:
    """Run a scene on a new loop."""
    loop = new_event_loop()
    try:
        loop.run_until_complete(asyncio.wait_for(scene(), 30))
    finally:
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.run_until_complete(loop.shutdown_default_executor())
        loop.close()


@contextlib.asynccontextmanager
async def running(variables: dict[str, str] = NO_MASTER) -> AsyncIterator[Node]:
    node = Node("/node", Environment.read(variables))
    await node.start()
    try:
        yield node
    finally:
        await node.close()


@pytest.mark.parametrize(
    ("call", "answer"),
    [
        (("getName", "/me"), [1, "", "/node"]),
        (("getName",), [-1, "missing required caller_id parameter", ""]),
        (("getName", 5), [-1, "caller_id must be a string", ""]),
        (("getName", "/me", 5), [-1, "Error: bad call arity", ""]),
        (("getBusStats", "/me"), [1, "", [[], [], []]]),
        (("publisherUpdate", "/me", "/t", "x"), [-1, "ERROR: param [publishers] must be a list", -1]),
        (
            ("publisherUpdate", "/me", "/t", [5]),
            [-1, "ERROR: param [publishers] must be a list of strings", -1],
        ),
        (("requestTopic", "/me", "/t", [["TCPROS"]]), [-1, "Not a publisher of [/t]", []]),
        (("system.multicall", []), []),
        (("system.multicall", [{"methodName": "getName", "params": ["/me"]}]), [[[1, "", "/node"]]]),
        (
            ("system.multicall", [5, {"methodName": "getNothing", "params": []}]),
            [
                {"faultCode": 1, "faultString": "a call is a struct of methodName and params"},
                {"faultCode": 1, "faultString": "<class 'Exception'>:method \"getNothing\" is not supported"},
            ],
        ),
    ],
)
def test_the_slave_api_answers(call: tuple[Any, ...], answer: Any) -> None:
    api = SlaveApi(Node("/node", Environment.read(NO_MASTER)))
    found = api.dispatch(call[0], call[1:])
    assert (finish(found) if isinstance(found, Generator) else found) == answer


def test_a_node_ignores_a_master_that_bumps_another_node_at_its_address() -> None:
    node = Node("/node", Environment.read(NO_MASTER))
    reasons: list[str] = []
    node.request_shutdown = reasons.append  # type: ignore[method-assign]
    api = SlaveApi(node)
    text = "[{}] Reason: new node registered with same name"
    assert api.dispatch("shutdown", ["/master", text.format("/old")]) == [-1, "this is /node", 0]
    assert reasons == []
    assert api.dispatch("shutdown", ["/master", text.format("/node")]) == [1, "shutdown", 0]
    assert api.dispatch("shutdown", ["/rosnode", text.format("/old")]) == [1, "shutdown", 0]
    assert len(reasons) == 2


def test_a_method_that_is_not_there_is_a_fault() -> None:
    with pytest.raises(RpcFault, match="getNothing"):
        SlaveApi(Node("/node", Environment.read(NO_MASTER))).dispatch("getNothing", ["/me"])


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"callerid": "/raw"}, "no topic or service name detected"),
        ({"topic": "/t", "callerid": "/raw"}, "[/node] is not a publisher of [/t]. Topics are []"),
        ({"service": "/s", "callerid": "/raw"}, "[/node] is not a provider of  [/s]"),
    ],
)
def test_a_peer_that_requests_an_unknown_topic_gets_an_error(
    fields: dict[str, str], error: str, caplog: pytest.LogCaptureFixture
) -> None:
    async def scene() -> None:
        async with running() as node:
            sock = await tcp.connect("127.0.0.1", node.tcpros_port)
            await tcp.send_header(sock, fields)
            assert await tcp.receive_header(sock) == {"error": error}
            assert await asyncio.get_running_loop().sock_recv(sock, 1) == b""
            sock.close()

    run(scene)
    assert f"Could not process inbound connection: {error}" in caplog.text


def test_clients_that_only_connect_leave_room_for_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_module, "MAX_IDLE", 20)

    async def scene() -> None:
        async with running() as node:
            rpc = AsyncRpcClient()
            port = int(node.uri.rsplit(":", 1)[1].strip("/"))
            idle: list[socket.socket] = []
            for number in range(200):
                idle.append(await tcp.connect("127.0.0.1", port))
                if number % 50 == 49:
                    assert await rpc.call(node.uri, "getName", "/me") == [1, "", "/node"]
            assert node.server
            assert node.server.clients <= 20
            await rpc.close()
            for sock in idle:
                sock.close()

    run(scene)


@pytest.mark.parametrize(
    ("host", "master", "warns"),
    [
        ("localhost", "192.0.2.1", True),
        ("127.0.0.1", "192.0.2.1", True),
        ("192.0.2.7", "192.0.2.1", False),
        ("localhost", "localhost", False),
    ],
)
def test_a_node_on_loopback_warns_of_a_master_on_another_host(
    host: str, master: str, warns: bool, caplog: pytest.LogCaptureFixture
) -> None:
    async def scene() -> None:
        async with running({"ROS_MASTER_URI": f"http://{master}:11411", "ROS_HOSTNAME": host}):
            pass

    run(scene)
    assert ("set ROS_IP" in caplog.text) == warns


def test_parameter_updates_are_delivered_in_order() -> None:
    values: list[int] = []
    both, later = threading.Event(), threading.Event()

    def on_parameter(key: str, value: int) -> None:
        if value == 1:
            # A second worker would report the second change in the meantime.
            later.wait(0.1)
        values.append(value)
        if value == 2:
            later.set()
            both.set()

    node = Node("/n", Environment.read(NO_MASTER), on_parameter=on_parameter)
    node.parameter_changed("/p", 1)
    node.parameter_changed("/p", 2)
    assert both.wait(30)
    assert values == [1, 2]


def test_other_threads_may_query_the_tables_while_they_change() -> None:
    node = Node("/n", Environment.read(NO_MASTER))

    class Publishing(Publication):
        @property
        def topic(self) -> str:
            node.publications["/other"] = Publication("/other", self.type)
            return "/t"

        @topic.setter
        def topic(self, topic: str) -> None:
            pass

    node.publications["/t"] = Publishing("/t", InterfaceType("std_msgs/Bool", "*"))
    assert SlaveApi(node).get_publications("/n")[2] == [["/t", "std_msgs/Bool"]]


def test_a_port_that_is_taken_leaves_nothing_open() -> None:
    async def scene() -> None:
        node = Node("/n", Environment.read(NO_MASTER))
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            with pytest.raises(OSError, match="use"):
                await node.start(xmlrpc_port=taken.getsockname()[1])
        port = node.tcpros_port
        assert port
        with pytest.raises(ConnectionRefusedError):
            await tcp.connect("127.0.0.1", port)

    run(scene)
