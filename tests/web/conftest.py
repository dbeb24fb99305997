"""A bridge on a loop in the test, and clients with real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import json
from collections.abc import Callable, Coroutine, Iterator
from pathlib import Path
from typing import Any, TypeVar

import cbor2
import pytest
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

import minirospy.web
from minirospy import Node
from minirospy.aio.topics import Publisher
from minirospy.runtime.transport.loop import LoopThread
from minirospy.web.bridge import Bridge, BridgeOptions
from tests.patience import PATIENCE, patient_limits

__all__ = ["FOXGLOVE", "Client", "RosbridgeClient", "Running", "bridge", "patient_limits", "run_bridge"]

_T = TypeVar("_T")
FOXGLOVE = Subprotocol("foxglove.websocket.v1")

# A test's client may not read for a long time; since version 15, websockets itself sends pings.
_PATIENT_CLIENT: dict[str, Any] = {"open_timeout": PATIENCE}
if "ping_interval" in inspect.signature(connect).parameters:
    _PATIENT_CLIENT["ping_interval"] = None


class Running:
    """A bridge and other nodes of the same graph, on one loop."""

    def __init__(self, options: BridgeOptions, **parts: Any) -> None:
        self.loop = LoopThread("test-bridge")
        self._options = options
        self._parts = parts
        self.nodes: list[Node] = []
        self._clients: list[Client | RosbridgeClient] = []
        try:
            self.bridge: Bridge = self.run(self._start())
        except BaseException:
            self.loop.close()
            raise

    @property
    def port(self) -> int:
        return self.bridge.listeners["foxglove"].port

    def run(self, work: Coroutine[object, object, _T]) -> _T:
        return self.loop.run(work, 60.0)

    def call(self, function: Callable[[], _T]) -> _T:
        """Call a function on the loop."""

        async def calling() -> _T:
            return function()

        return self.run(calling())

    def node(self, name: str) -> Node:
        async def start() -> Node:
            node = Node(name, rosout=False)
            await node.start()
            self.nodes.append(node)
            return node

        return self.run(start())

    def publisher(self, node: Node, topic: str, cls: type, **options: Any) -> Publisher[Any]:
        async def advertise() -> Publisher[Any]:
            return await node.advertise(topic, cls, **options)

        return self.run(advertise())

    def client(self, **options: Any) -> Client:
        client = Client(self.port, **options)
        self._clients.append(client)
        return client

    def rosbridge(self, **options: Any) -> RosbridgeClient:
        client = RosbridgeClient(self.bridge.listeners["rosbridge"].port, **options)
        self._clients.append(client)
        return client

    def close(self) -> None:
        for client in self._clients:
            client.close()
        self.run(self._close())
        self.loop.close()

    async def _start(self) -> Bridge:
        node = Node("bridge", rosout=False)
        await node.start()
        bridge = Bridge(node, self._options, **self._parts)
        try:
            await bridge.start()
        except BaseException:
            await bridge.close()
            await node.close()
            raise
        self.nodes.append(node)
        return bridge

    async def _close(self) -> None:
        await self.bridge.close()
        for node in reversed(self.nodes):
            await node.close()
        left = asyncio.all_tasks() - {asyncio.current_task()}
        assert not [task for task in left if _is_of_the_bridge(task)], left


class Client:
    """A client of the Foxglove protocol; received messages are stored by op until a test reads them."""

    def __init__(
        self,
        port: int,
        *,
        path: str = "/",
        scheme: str = "ws",
        subprotocols: tuple[Subprotocol, ...] | None = (FOXGLOVE,),
        **options: Any,
    ) -> None:
        options = {"max_size": None, **_PATIENT_CLIENT, **options}
        self._stack = contextlib.ExitStack()
        opening = connect(
            f"{scheme}://127.0.0.1:{port}{path}", subprotocols=subprotocols, compression=None, **options
        )
        self.socket: ClientConnection = self._stack.enter_context(opening)
        self.channels: dict[str, dict[str, Any]] = {}
        self.services: dict[str, dict[str, Any]] = {}
        self.kept: list[dict[str, Any] | bytes] = []

    def send(self, **fields: Any) -> None:
        self.socket.send(json.dumps(fields))

    def send_binary(self, data: bytes) -> None:
        self.socket.send(data)

    def next(self, op: str, accepts: Callable[[dict[str, Any]], bool] = lambda _: True) -> dict[str, Any]:
        """Return the next JSON message with this op that ``accepts`` accepts."""
        return self.next_accepted(lambda each: isinstance(each, dict) and each["op"] == op and accepts(each))  # type: ignore[return-value]

    def next_binary(self, opcode: int) -> bytes:
        """Return the next binary message with this opcode."""
        return self.next_accepted(lambda each: isinstance(each, bytes) and each[0] == opcode)  # type: ignore[return-value]

    def channel(self, topic: str) -> int:
        """Return a topic's channel once it is advertised."""
        while topic not in self.channels:
            self.next("advertise")
        return int(self.channels[topic]["id"])

    def service(self, name: str) -> int:
        """Return a service's id once it is advertised."""
        while name not in self.services:
            self.next("advertiseServices")
        return int(self.services[name]["id"])

    def subscribe(self, topic: str, id_: int = 0) -> None:
        self.send(op="subscribe", subscriptions=[{"id": id_, "channelId": self.channel(topic)}])

    def close(self) -> None:
        self._stack.close()

    def next_accepted(self, accepts: Callable[[dict[str, Any] | bytes], bool]) -> dict[str, Any] | bytes:
        for number, each in enumerate(self.kept):
            if accepts(each):
                return self.kept.pop(number)
        while True:
            data = self.socket.recv(timeout=30)
            each = json.loads(data) if isinstance(data, str) else data
            if isinstance(each, dict):
                self._learn(each)
            if accepts(each):
                return each
            self.kept.append(each)

    def _learn(self, fields: dict[str, Any]) -> None:
        for kind, table in (("channels", self.channels), ("services", self.services)):
            for each in fields.get(kind, ()):
                table[each.get("topic", each.get("name"))] = each
        for id_ in fields.get("channelIds", ()):
            for topic in [topic for topic, each in self.channels.items() if each["id"] == id_]:
                del self.channels[topic]


class RosbridgeClient:
    """A rosbridge client; received messages are stored until a test reads them. The library cbor2 decodes CBOR."""

    def __init__(self, port: int, *, path: str = "/", **options: Any) -> None:
        self._stack = contextlib.ExitStack()
        options = {"max_size": None, **_PATIENT_CLIENT, **options}
        opening = connect(f"ws://127.0.0.1:{port}{path}", compression=None, **options)
        self.socket: ClientConnection = self._stack.enter_context(opening)
        self.kept: list[dict[str, Any]] = []

    def send(self, **fields: Any) -> None:
        self.socket.send(json.dumps(fields))

    def next(self, op: str, **fields: Any) -> dict[str, Any]:
        """Return the next message with this op and these fields."""
        for number, each in enumerate(self.kept):
            if _has(each, op, fields):
                return self.kept.pop(number)
        while True:
            data = self.socket.recv(timeout=30)
            found: dict[str, Any] = json.loads(data) if isinstance(data, str) else cbor2.loads(data)
            if _has(found, op, fields):
                return found
            self.kept.append(found)

    def call(self, service: str, args: object = None, **options: Any) -> dict[str, Any]:
        """Return the response to a service call."""
        id_ = f"call:{service}"
        self.send(op="call_service", id=id_, service=service, args=args, **options)
        return self.next("service_response", id=id_)

    def synchronize(self) -> None:
        """Return when everything that was sent has been handled."""
        self.send(op="jump", id="synchronize")
        assert "Unknown operation" in self.next("status", id="synchronize")["msg"]

    def close(self) -> None:
        self._stack.close()


def _is_of_the_bridge(task: asyncio.Task[Any]) -> bool:
    """Return whether a task runs a coroutine function of minirospy.web."""
    code = getattr(task.get_coro(), "cr_code", None)
    return code is not None and Path(minirospy.web.__path__[0]) in Path(code.co_filename).parents


def _has(message: dict[str, Any], op: str, fields: dict[str, Any]) -> bool:
    return message.get("op") == op and all(message.get(name) == value for name, value in fields.items())


@pytest.fixture
def run_bridge(master: str) -> Iterator[Callable[..., Running]]:
    """Return a function that starts a bridge with these options on a free port."""
    running: list[Running] = []

    def start(playback: Any = None, **options: Any) -> Running:
        options = {"foxglove_port": 0, "rosbridge_port": 0, "diagnostics": False, **options}
        running.append(Running(BridgeOptions(**options), playback=playback))
        return running[-1]

    yield start
    for each in running:
        each.close()


@pytest.fixture
def bridge(run_bridge: Callable[..., Running]) -> Running:
    """Return a running bridge."""
    return run_bridge()
