"""The robot half of a gateway.

The exporter announces the robot's graph, sends topics that have readers, and delivers messages and calls.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable, Collection, Coroutine, Mapping
from typing import TYPE_CHECKING

from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.fleet.definitions import Definitions
from minirospy.fleet.inbound import InboundTopic, call_service, run_on_loop
from minirospy.fleet.keys import (
    ROOT,
    Claim,
    claim_key,
    parse_call,
    parse_claim,
    parse_in,
    parse_offer,
    parse_want,
    replay_key,
    service_key,
    topic_key,
)
from minirospy.fleet.network import Deferred, FleetNetwork, QueryFailed
from minirospy.fleet.outbound import OutboundTopic
from minirospy.fleet.robot_graph import RobotGraph
from minirospy.fleet.rules import GatewayRules
from minirospy.fleet.sender import Receiver, Sender
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["Exporter"]

_log = logging.getLogger(__name__)
_MAX_IN_FLOWS = 1_000
MAX_WANTED, MAX_READERS = 10_000, 1_000
"""Maximum number of topics that peers may request, and of readers per topic: limits the memory that peers can use."""


class Exporter:
    """Announces the graph of one robot to the fleet. Runs on the node's loop."""

    def __init__(
        self,
        node: Node,
        network: FleetNetwork,
        definitions: Definitions,
        sender: Sender,
        receiver: Receiver,
        claim: Claim,
        rules: GatewayRules,
        hidden: Callable[[], Collection[str]],
        spawn: Callable[[Coroutine[object, object, None]], object],
    ) -> None:
        """Create the exporter. ``hidden`` returns the names of the imported robots, whose topics are not announced again."""
        self.claim = claim
        self.duplicates: tuple[Claim, ...] = ()
        self.graph = RobotGraph(node, definitions, claim, rules, hidden)
        self.outbound: dict[str, OutboundTopic] = {}
        self.inbound: dict[str, InboundTopic] = {}
        self._node = node
        self._network = network
        self._definitions = definitions
        self._sender = sender
        self._receiver = receiver
        self._rules = rules
        self._spawn = spawn
        self._tokens: dict[str, Deferred] = {}
        self.readers: dict[str, set[str]] = {}
        self._claims = {claim}
        self._rivals = RateLimitedLogger(_log)
        self._flows = Receiver.flows(_MAX_IN_FLOWS)
        self._reporter = ErrorReporter(_log, "the watch of the robot's graph")
        self._watching: asyncio.Task[None] | None = None
        self._declared: list[Deferred] = []

    async def start(self) -> None:
        """Start announcing the robot's graph until :meth:`close`.

        Raise MasterUnreachableError if no master responds, or RpcError if the call fails.
        """
        await self.look()
        network, ends = self._network, f"{self.claim.name}/{self.claim.gateway}"
        self._declared = [
            network.subscribe(f"{ROOT}/in/{ends}/**", self._arrived),
            network.answer(f"{ROOT}/call/{ends}/**", self._call),
            network.answer(f"{ROOT}/param/{ends}", self._parameter),
            network.watch_tokens(f"{ROOT}/want/{ends}/**", self.want_changed),
            network.watch_tokens(f"{ROOT}/offer/{ends}/**", self._offer_changed),
            network.watch_tokens(f"{ROOT}/robot/{self.claim.name}/**", self._claim_changed),
            network.declare_token(claim_key(self.claim)),
        ]
        self._watching = asyncio.ensure_future(
            keep_running(lambda: self.graph.watch(self.look), self._reporter)
        )

    async def close(self) -> None:
        """Withdraw all announcements. Idempotent."""
        watching, self._watching = self._watching, None
        if watching:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
        await self.graph.close()
        for declared in [*self._declared, *self._tokens.values()]:
            declared.undeclare()
        self._declared, self._tokens = [], {}
        await asyncio.gather(
            *(topic.close() for topic in self.outbound.values()),
            *(topic.close() for topic in self.inbound.values()),
        )
        self.outbound, self.inbound = {}, {}

    async def look(self) -> bool:
        """Announce the current graph; return whether it has changed.

        Raise MasterUnreachableError if no master responds, or RpcError if the call fails.
        """
        changed = await self.graph.look()
        self._announce()
        await self._adjust()
        return changed

    # --- announcements

    def _announce(self) -> None:
        keys = {topic_key(each) for each in self.graph.topics.values()}
        keys |= {service_key(each) for each in self.graph.services.values()}
        # Declare new tokens before removing old ones, so that a topic has a token even while its flags change.
        for key in keys - self._tokens.keys():
            self._tokens[key] = self._network.declare_token(key)
        for key in self._tokens.keys() - keys:
            self._tokens.pop(key).undeclare()

    # --- requests and offers from other gateways

    def want_changed(self, key: str, is_there: bool) -> None:
        want = parse_want(key)
        if want is None:
            return
        if is_there and want.topic not in self.readers and len(self.readers) >= MAX_WANTED:
            return
        readers = self.readers.setdefault(want.topic, set())
        if is_there and len(readers) < MAX_READERS:
            readers.add(want.reader)
            outbound = self.outbound.get(want.topic)
            if outbound:
                ends = outbound.token.robot, outbound.token.gateway, outbound.token.md5sum
                outbound.replay(replay_key(*ends, want.topic, want.reader))
        else:
            readers.discard(want.reader)
        if not readers:
            del self.readers[want.topic]
        self._spawn(self._adjust())

    def _offer_changed(self, key: str, is_there: bool) -> None:
        offer = parse_offer(key)
        if offer is None:
            return
        inbound = self._inbound_of(offer.topic) if is_there else self.inbound.get(offer.topic)
        if inbound:
            inbound.offer_changed(offer, is_there)

    def _claim_changed(self, key: str, is_there: bool) -> None:
        claim = parse_claim(key)
        if claim is None or claim == self.claim:
            return
        if is_there and len(self._claims) < 100:
            self._claims.add(claim)
        else:
            self._claims.discard(claim)
        before, self.duplicates = self.duplicates, tuple(sorted(self._claims - {self.claim}))
        others = [each for each in self.duplicates if each.host != self.claim.host]
        if others and not any(each.host != self.claim.host for each in before):
            self._rivals.error(
                "another machine, %s (gateway %s), calls itself [%s], too: a control room shows the one that it saw first, and "
                "refuses the other. Give one of them another name (--name). This machine is %s (gateway %s)",
                others[0].host,
                others[0].gateway,
                self.claim.name,
                self.claim.host,
                self.claim.gateway,
            )

    async def _adjust(self) -> None:
        """Open and close outbound and inbound topics to match the graph and the peers' requests."""
        # Iterate over a copy, because closing awaits the master, and concurrent calls may change both tables meanwhile.
        for topic, outbound in list(self.outbound.items()):
            token = self.graph.topics.get(topic)
            if self.outbound.get(topic) is outbound and (
                token is None or not token.has_same_messages(outbound.token) or topic not in self.readers
            ):
                del self.outbound[topic]
                await outbound.close()

        for topic in list(self.readers):
            token = self.graph.topics.get(topic)
            if token and token.is_published and topic not in self.outbound:
                priority = self._rules.priority(topic, token.type)
                outbound = OutboundTopic(
                    self._node,
                    token,
                    self._sender.flow(priority, self._rules.rate(topic)),
                    await self._definitions.rewriter(token.type, token.md5sum) if token.has_frames else None,
                )
                if topic in self.readers and topic not in self.outbound:
                    self.outbound[topic] = outbound
                    outbound.open()
        for topic, inbound in list(self.inbound.items()):
            token = self.graph.topics.get(topic)
            if self.inbound.get(topic) is inbound and (
                token is None or not token.is_subscribed or inbound.is_idle
            ):
                del self.inbound[topic]
                await inbound.close()

    # --- messages, service calls and queries from other gateways

    def _inbound_of(self, topic: str) -> InboundTopic | None:
        """Return the local publisher for a topic's inbound messages, or None if no local node subscribes to the topic."""
        inbound = self.inbound.get(topic)
        token = self.graph.topics.get(topic)
        if inbound is None and token is not None and token.is_subscribed:
            inbound = self.inbound[topic] = InboundTopic(
                self._node,
                self._definitions,
                token,
                self._spawn,
                self._rules.has_frames,
                stop_seconds=self._rules.stop_seconds,
            )
        return inbound

    def _arrived(self, key: str, message: bytes, attachment: bytes) -> None:
        """Queue an inbound message for this robot. Runs in one of Zenoh's threads."""
        parsed = parse_in(key)
        token = self.graph.topics.get(parsed[0]) if parsed else None
        if parsed is None or token is None or not token.is_subscribed:
            return
        topic, md5sum, writer = parsed
        flow = self._flows.of((topic, writer))
        if flow is not None:
            self._receiver.add(
                flow, lambda body, _: self._deliver(topic, md5sum, writer, body), message, attachment
            )

    def _deliver(self, topic: str, md5sum: str, writer: str, body: bytes) -> None:
        """Publish an inbound message locally. Runs in the receiver's thread."""
        inbound = self.inbound.get(topic)
        if inbound is None or not inbound.publish(md5sum, body):
            run_on_loop(self._node, self._hold(topic, md5sum, writer, body))

    async def _hold(self, topic: str, md5sum: str, writer: str, body: bytes) -> None:
        inbound = self._inbound_of(topic)
        if inbound:
            inbound.keep(md5sum, writer, body)

    async def _call(self, key: str, request: bytes) -> bytes:
        parsed = parse_call(key)
        token = self.graph.services.get(parsed[0]) if parsed else None
        if parsed is None or token is None:
            raise QueryFailed("the robot has no such service")
        if token.md5sum != parsed[1]:
            raise QueryFailed(f"the service has the md5sum {token.md5sum}, not {parsed[1]}")
        return await call_service(self._node, token, request)

    async def _parameter(self, _: str, request: bytes) -> bytes:
        name = request.decode(errors="replace") or "/"
        if not self._rules.parameters(name):
            raise QueryFailed(f"the parameter [{name}] may not be read")
        try:
            value = await self._node.get_param(name)
        except KeyError:
            raise QueryFailed(f"Parameter [{name}] is not set") from None
        if isinstance(value, dict):
            value = self._allowed(name, value)
        return json.dumps(value, default=str).encode()

    def _allowed(self, name: str, tree: Mapping[str, object]) -> dict[str, object]:
        """Return the part of a parameter tree that clients may read."""
        found: dict[str, object] = {}
        for key, value in tree.items():
            full = f"{name.rstrip('/')}/{key}"
            if isinstance(value, dict):
                found[key] = self._allowed(full, value)
            elif self._rules.parameters(full):
                found[key] = value
        return found
