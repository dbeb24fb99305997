"""A gateway: one Zenoh session with a robot half, a control room half, or both."""

from __future__ import annotations

import asyncio
import hashlib
import json
import logging
import platform
import secrets
import time
import uuid
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import BridgeError, MasterUnreachableError, ROSInterruptException, RpcError
from minirospy.fleet.definitions import Definitions
from minirospy.fleet.exporter import Exporter
from minirospy.fleet.importer import Importer
from minirospy.fleet.keys import ROOT, Claim, claim_key, is_robot_name, parse_definition
from minirospy.fleet.network import Deferred, FleetNetwork, NetworkOptions, QueryFailed
from minirospy.fleet.ros1_side import Ros1Side
from minirospy.fleet.rules import GatewayRules
from minirospy.fleet.sender import Outflow, Receiver, Sender
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["REGISTRATION_FAULT_LINES", "Gateway", "GatewayOptions"]

REGISTRATION_FAULT_LINES = 1
"""Maximum number of registration errors that a gateway's node logs in ten seconds.

Thus, if a master rejects the topics of 1,000 robots, only one line is logged.
"""
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class GatewayOptions:
    """A gateway's settings.

    ``name`` is the robot's name, or "" for a gateway that is only a control room. If ``imports``, the fleet's robots are
    shown here. ``ros1_namespace`` is the namespace of zenoh-bridge-ros1's keys, or "" to not use those keys. ``clock``
    returns the time in ns, ``host`` identifies the machine ("" for the default); tests replace both.
    """

    name: str = ""
    imports: bool = False
    ros1_namespace: str = ""
    network: NetworkOptions = field(default_factory=NetworkOptions)
    rules: GatewayRules = field(default_factory=GatewayRules)
    clock: Callable[[], int] = time.time_ns
    host: str = ""


class Gateway:
    """Connects a master to the fleet: forwards topics and services. Runs on the node's loop."""

    def __init__(self, node: Node, options: GatewayOptions) -> None:
        """Create the gateway. Raise BridgeError if the name in the options is not a valid robot name."""
        if options.name and not is_robot_name(options.name):
            raise BridgeError(
                f"[{options.name}] cannot be a robot's name: letters, digits and underscores, a letter first"
            )
        self.node = node
        self.options = options
        self.id = secrets.token_hex(8)
        self.exporter: Exporter | None = None
        self.importer: Importer | None = None
        self.ros1: Ros1Side | None = None
        self.network: FleetNetwork | None = None
        host = options.host or hashlib.sha256(f"{uuid.getnode()}".encode()).hexdigest()[:16]
        self.claim = Claim(options.name or "-", self.id, options.clock(), host)
        self._since = time.monotonic()
        self._definitions: Definitions | None = None
        self._sender: Sender | None = None
        self._receiver: Receiver | None = None
        self._declared: list[Deferred] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._reporter = ErrorReporter(_log, "a task of the gateway")
        self._failures = RateLimitedLogger(_log)

    async def connect(self) -> None:
        """Open the session; if a router is configured, wait for it. May be called before the node starts.

        Raise BridgeError if the configuration is invalid.
        """
        if self.network is None:
            self.network = await FleetNetwork.open(self.options.network)

    async def start(self) -> None:
        """Connect to the fleet if necessary, and start to forward topics and services, until :meth:`close`.

        Raise BridgeError if the fleet cannot be joined, MasterUnreachableError or RpcError if a call to the master fails,
        or ROSInterruptException if the node is shut down first.
        """
        options = self.options
        await self._wait_for_network()
        network = self.network
        assert network
        definitions = self._definitions = Definitions(self.node, network)
        sender = self._sender = Sender(network, options.clock)
        receiver = self._receiver = Receiver()
        self._declared = [
            network.answer(f"{ROOT}/ping/{self.id}", self._pong, is_control=True),
            network.answer(f"{ROOT}/status/{self.id}", self._status, is_control=True),
            network.answer(f"{ROOT}/definition/{self.id}/*/*", self._definition, is_control=True),
        ]
        if options.imports:
            self.importer = Importer(
                self.node,
                network,
                definitions,
                sender,
                receiver,
                self.id,
                options.name,
                options.rules,
                self._spawn,
                options.clock,
            )
            await self.importer.start()
            self._declared.append(network.declare_token(claim_key(self.claim, "control")))

        if options.name:
            self.exporter = Exporter(
                self.node,
                network,
                definitions,
                sender,
                receiver,
                self.claim,
                options.rules,
                self._hidden,
                self._spawn,
            )
            await self.exporter.start()
        if options.ros1_namespace:
            self.ros1 = Ros1Side(
                self.node,
                network,
                definitions,
                sender,
                receiver,
                self.claim,
                options.rules,
                options.ros1_namespace,
                self._hidden,
                self._spawn,
            )
            await self.ros1.start()

    async def close(self) -> None:
        """Leave the fleet. Idempotent."""
        for declared in self._declared:
            declared.undeclare()
        self._declared = []
        if self.exporter:
            await self.exporter.close()
        if self.importer:
            await self.importer.close()
        if self.ros1:
            await self.ros1.close()
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._definitions:
            await self._definitions.close()
        if self._sender:
            self._sender.close()
        if self.network:
            await self.network.close()
        if self._receiver:
            self._receiver.close()

    def status(self) -> dict[str, object]:
        """Return this gateway's configuration and counters, as JSON-compatible values."""
        found: dict[str, object] = {
            "name": self.options.name,
            "gateway": self.id,
            "machine": platform.node(),
            "seconds": round(time.monotonic() - self._since, 1),
            "peers": self.network.peers if self.network else 0,
        }
        if self.exporter:
            exporter = self.exporter
            found["master"] = exporter.graph.is_master_reached
            found["topics"] = len(exporter.graph.topics)
            found["services"] = len(exporter.graph.services)
            found["duplicates"] = len(exporter.duplicates)
            found["sent"] = [
                {"topic": topic, **_outflow(each.outflow)} for topic, each in exporter.outbound.items()
            ]
            found["passed_in"] = [
                {"topic": topic, "messages": each.passed} for topic, each in exporter.inbound.items()
            ]

        if self.ros1:
            found["ros1_keys"] = self.ros1.status()
        if self.importer:
            found["refused"] = self.importer.contents.refused
            found["refused_gateways"] = len(self.importer.contents.waiting)
            found["robots"] = [
                {
                    "name": name,
                    "gateway": shown.robot.claim.gateway,
                    "topics": len(shown.topics),
                    "services": len(shown.services),
                    "offset": shown.clock.offset / 1e9 if shown.clock else None,
                    "round_trip": shown.clock.round_trip / 1e9 if shown.clock else None,
                    "duplicates": len(shown.robot.duplicates),
                    "links": [
                        {
                            "topic": topic.name,
                            "messages": topic.received,
                            "lost": topic.lost,
                            "dropped": topic.dropped,
                            "delay": topic.delay.mean / 1e9,
                            "longest": topic.delay.longest / 1e9,
                        }
                        for topic in shown.topics.values()
                        if topic.is_open or topic.received
                    ],
                    "to_robot": [
                        {"topic": topic.name, **_outflow(topic.outflow)}
                        for topic in shown.topics.values()
                        if topic.outflow and topic.outflow.sent
                    ],
                }
                for name, shown in self.importer.robots.items()
            ]
        return found

    async def _wait_for_network(self) -> None:
        """Open the session. Raise ROSInterruptException if the node shuts down before it is open."""
        opening = asyncio.ensure_future(self.connect())
        ending = asyncio.ensure_future(self.node.spin())
        try:
            await asyncio.wait([opening, ending], return_when=asyncio.FIRST_COMPLETED)
            if not opening.done():
                raise ROSInterruptException("ROS shutdown request")
            opening.result()
        finally:
            for task in (opening, ending):
                task.cancel()
            await asyncio.gather(opening, ending, return_exceptions=True)

    def _hidden(self) -> list[str]:
        """Return the names of the imported robots, whose topics must not be announced again."""
        return self.importer.names if self.importer else []

    async def _pong(self, _: str, __: bytes) -> bytes:
        return self.options.clock().to_bytes(8, "little", signed=True)

    async def _status(self, _: str, __: bytes) -> bytes:
        return json.dumps(self.status()).encode()

    async def _definition(self, key: str, _: bytes) -> bytes:
        assert self._definitions
        parsed = parse_definition(key)
        if parsed is None:
            raise QueryFailed("this is not the key of a definition")
        text = await self._definitions.text(*parsed)
        if not text:
            raise QueryFailed("this gateway does not know the definition")
        return text.encode()

    def _spawn(self, work: Coroutine[object, object, None]) -> asyncio.Task[None]:
        """Run a coroutine as a task until :meth:`close`; log its exceptions."""

        async def guarded() -> None:
            try:
                await work
            except (MasterUnreachableError, RpcError, QueryFailed) as error:
                self._failures.warning("%s", error)
            except Exception as error:  # noqa: BLE001 - nothing else would report a task's exception
                self._reporter.report(error)

        task = asyncio.ensure_future(guarded())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        # If the task is cancelled before its first step, the coroutine was never started and must be closed.
        task.add_done_callback(lambda _: work.close())
        return task


def _outflow(flow: Outflow) -> dict[str, object]:
    return {
        "messages": flow.sent,
        "bytes": flow.sent_bytes,
        "dropped": flow.dropped,
        "throttled": flow.throttled,
        "priority": flow.priority.name.lower(),
    }
