"""Masters, gateways and nodes of a fleet on one event loop. They use only loopback, and no multicast."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from minirospy import Node
from minirospy.aio.node import MAX_REGISTRATION_FAULTS
from minirospy.fleet.gateway import REGISTRATION_FAULT_LINES, Gateway, GatewayOptions
from minirospy.fleet.network import NetworkOptions
from minirospy.runtime.master.master import Master
from minirospy.runtime.transport.loop import LoopThread
from tests.conftest import free_port
from tests.waiting import until

_T = TypeVar("_T")
SECONDS = 60.0


class Place:
    """A master and its nodes, which are a robot or a control room."""

    def __init__(self, fleet: Fleet, master: Master) -> None:
        self.fleet = fleet
        self.master = master
        self.uri = f"http://localhost:{master.port}"
        self.nodes: list[Node] = []

    def node(self, name: str, *, registration_fault_lines: int = MAX_REGISTRATION_FAULTS) -> Node:
        async def start() -> Node:
            node = Node(
                name,
                rosout=False,
                master_uri=self.uri,
                registration_fault_lines=registration_fault_lines,
            )
            await node.start()
            self.nodes.append(node)
            return node

        return self.fleet.run(start())

    def gateway(
        self, name: str = "", *, endpoint: str = "", listens: bool = False, **options: Any
    ) -> Gateway:
        """Start a gateway, for a robot if it has a name, otherwise for a control room."""
        endpoint = endpoint or self.fleet.endpoint
        network = NetworkOptions(listen=(endpoint,)) if listens else NetworkOptions(connect=(endpoint,))
        options.setdefault("imports", not name)
        gateway = Gateway(
            self.node(f"fleet_{name or 'control'}", registration_fault_lines=REGISTRATION_FAULT_LINES),
            GatewayOptions(name, network=network, **options),
        )
        self.fleet.gateways.append(gateway)
        self.fleet.run(gateway.start())
        return gateway

    def names(self) -> set[str]:
        """Return the topics that the master lists."""
        return self.fleet.run(self.fetch_names())

    def services(self) -> set[str]:
        return self.fleet.run(self.fetch_services())

    async def fetch_names(self) -> set[str]:
        published, subscribed, _ = await self.fetch_state()
        return {name for name, _ in [*published, *subscribed]}

    async def fetch_services(self) -> set[str]:
        return {name for name, _ in (await self.fetch_state())[2]}

    async def fetch_state(self) -> Any:
        from minirospy.runtime.rpc.async_client import AsyncRpcClient

        client = AsyncRpcClient()
        try:
            answer: Any = await client.call(self.uri, "getSystemState", "/test")
            return answer[2]
        finally:
            await client.close()


class Fleet:
    """All masters, gateways and nodes of a test."""

    def __init__(self) -> None:
        self.loop = LoopThread("test-fleet")
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.places: list[Place] = []
        self.gateways: list[Gateway] = []

    def run(self, work: Coroutine[object, object, _T]) -> _T:
        return self.loop.run(work, SECONDS)

    def call(self, function: Callable[[], _T]) -> _T:
        async def calling() -> _T:
            return function()

        return self.run(calling())

    def place(self) -> Place:
        async def start() -> Master:
            master = Master()
            await master.start()
            return master

        place = Place(self, self.run(start()))
        self.places.append(place)
        return place

    def until(self, condition: Callable[[], Any]) -> Any:
        """Check a condition on the loop repeatedly; return its value once it is true."""
        return self.run(until(condition, pause=0.02))

    def until_shown(self, place: Place, *topics: str) -> None:
        """Return when a place's master lists these topics."""

        async def are_shown() -> bool:
            return set(topics) <= await place.fetch_names()

        self.until(are_shown)

    def until_gone(self, place: Place, *topics: str) -> None:
        async def are_gone() -> bool:
            return not set(topics) & await place.fetch_names()

        self.until(are_gone)

    def stop(self, gateway: Gateway) -> None:
        """Close a gateway and its node, as at a shutdown."""

        async def ending() -> None:
            await gateway.close()
            await gateway.node.close()

        self.gateways.remove(gateway)
        self.run(ending())

    def close(self) -> None:
        for gateway in reversed(self.gateways):
            self.run(gateway.close())
        for place in self.places:
            for node in reversed(place.nodes):
                self.run(node.close())
            self.run(place.master.close())
        self.loop.close()
