"""A robot's side: its graph is announced, topics that somebody wants are sent, messages and calls for it are passed on."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import Callable, Collection, Coroutine, Mapping
from typing import TYPE_CHECKING, TypeVar

from minirospy.aio.raw import call_raw, service_header
from minirospy.bridge.fleet.definitions import Definitions
from minirospy.bridge.fleet.inbound import InboundTopic
from minirospy.bridge.fleet.keys import (
    ROOT,
    UNKNOWN_MD5,
    Claim,
    ServiceToken,
    TopicToken,
    claim_key,
    is_md5,
    parse_call,
    parse_claim,
    parse_in,
    parse_offer,
    parse_want,
    service_key,
    topic_key,
)
from minirospy.bridge.fleet.network import FleetNetwork, Later, QueryFailed
from minirospy.bridge.fleet.outbound import OutboundTopic
from minirospy.bridge.fleet.rules import Export, GatewayRules, exported_services, exported_topics, holder
from minirospy.bridge.fleet.sender import Intake, Sender
from minirospy.bridge.tasks import Faults, keep_running
from minirospy.errors import MasterUnreachableError, MinirospyError, RpcError, ServiceException
from minirospy.introspect.snapshot import fetch
from minirospy.wire.header import Header

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["Exporter"]

_log = logging.getLogger(__name__)
_FASTEST_LOOK, _SLOWEST_LOOK = 0.25, 2.0
_PROBE_SECONDS, _AGAIN_SECONDS = 3.0, 10.0
_PROBES = 8
_MOST_IN_FLOWS = 1_000
_MOST_WANTED, _MOST_READERS = 10_000, 1_000
"""Topics that readers may want, and readers of each, which peers choose."""

_Key = TypeVar("_Key", bound=tuple[str, object])


class Exporter:
    """Shows one robot's graph to the fleet. All on the node's loop."""

    def __init__(
        self,
        node: Node,
        network: FleetNetwork,
        definitions: Definitions,
        sender: Sender,
        intake: Intake,
        claim: Claim,
        rules: GatewayRules,
        hidden: Callable[[], Collection[str]],
        spawn: Callable[[Coroutine[object, object, None]], object],
    ) -> None:
        """``hidden``: names of robots whose topics are here as their copies."""
        self.claim = claim
        self.duplicates: tuple[Claim, ...] = ()
        self.is_master_reached = True
        self.topics: dict[str, TopicToken] = {}
        self.services: dict[str, ServiceToken] = {}
        self.outbound: dict[str, OutboundTopic] = {}
        self.inbound: dict[str, InboundTopic] = {}
        self._node = node
        self._network = network
        self._definitions = definitions
        self._sender = sender
        self._intake = intake
        self._rules = rules
        self._hidden = hidden
        self._spawn = spawn
        self._tokens: dict[str, Later] = {}
        self._readers: dict[str, set[str]] = {}
        self._headers: dict[tuple[str, str], Header] = {}
        self._service_types: dict[tuple[str, tuple[str, ...]], tuple[str, str]] = {}
        self._not_before: dict[tuple[str, object], float] = {}
        self._claims = {claim}
        self._probing = asyncio.Semaphore(_PROBES)
        self._flows = Intake.flows(_MOST_IN_FLOWS)
        self._faults = Faults(_log, "the watch of the robot's graph")
        self._watching: asyncio.Task[None] | None = None
        self._declared: list[Later] = []

    async def start(self) -> None:
        """Announce the robot until :meth:`close`. Raises MasterUnreachableError, RpcError."""
        await self.look()
        network, ends = self._network, f"{self.claim.name}/{self.claim.gateway}"
        self._declared = [
            network.subscribe(f"{ROOT}/in/{ends}/**", self._arrived),
            network.answer(f"{ROOT}/call/{ends}/**", self._call),
            network.answer(f"{ROOT}/param/{ends}", self._parameter),
            network.watch_tokens(f"{ROOT}/want/{ends}/**", self._want_changed),
            network.watch_tokens(f"{ROOT}/offer/{ends}/**", self._offer_changed),
            network.watch_tokens(f"{ROOT}/robot/{self.claim.name}/**", self._claim_changed),
            network.declare_token(claim_key(self.claim)),
        ]
        self._watching = asyncio.ensure_future(keep_running(self._watch, self._faults))

    async def close(self) -> None:
        """Withdraw all. Idempotent."""
        watching, self._watching = self._watching, None
        if watching:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
        for declared in [*self._declared, *self._tokens.values()]:
            declared.undeclare()
        self._declared, self._tokens = [], {}
        await asyncio.gather(
            *(topic.close() for topic in self.outbound.values()),
            *(topic.close() for topic in self.inbound.values()),
        )
        self.outbound, self.inbound = {}, {}

    async def look(self) -> bool:
        """Announce the graph as it is now; whether it has changed. Raises MasterUnreachableError, RpcError."""
        snapshot = await fetch(self._node._node.master)
        hidden = self._hidden()
        exports = exported_topics(snapshot, self._node.name, self._rules.topics, hidden)
        services = exported_services(snapshot, self._node.name, self._rules.services, hidden)
        await self._look_at_publishers(exports)
        await self._look_at_services(services)

        topics = {}
        for export in exports.values():
            token = await self._topic_token(export)
            if token:
                topics[export.topic] = token
        found = {
            name: ServiceToken(self.claim.name, self.claim.gateway, name, *self._service_types[name, nodes])
            for name, nodes in services.items()
            if (name, nodes) in self._service_types
        }
        changed = topics != self.topics or found != self.services
        self.topics, self.services = topics, found
        self._announce()
        await self._adjust()
        return changed

    async def _watch(self) -> None:
        pause = _FASTEST_LOOK
        while True:
            await asyncio.sleep(pause)
            changed = False
            started = time.monotonic()
            try:
                changed = await self.look()
                if not self.is_master_reached:
                    _log.info("the master answers again")
                self.is_master_reached = True
            except (MasterUnreachableError, RpcError) as error:
                if self.is_master_reached:
                    _log.warning("the graph cannot be read: %s. Will keep trying.", error)
                self.is_master_reached = False
            slowest = max(_SLOWEST_LOOK, 20 * (time.monotonic() - started))
            pause = _FASTEST_LOOK if changed else min(pause * 1.5, slowest)

    # --- what is announced

    def _announce(self) -> None:
        keys = {topic_key(each) for each in self.topics.values()}
        keys |= {service_key(each) for each in self.services.values()}
        # New ones first: a topic whose flags have changed is never without a token.
        for key in keys - self._tokens.keys():
            self._tokens[key] = self._network.declare_token(key)
        for key in self._tokens.keys() - keys:
            self._tokens.pop(key).undeclare()

    async def _topic_token(self, export: Export) -> TopicToken | None:
        headers = [
            header
            for publisher in export.publishers
            if (header := self._headers.get((export.topic, publisher))) is not None
        ]
        type_, md5sum = export.type, UNKNOWN_MD5
        if headers:
            type_, md5sum = headers[0].get("type", ""), headers[0].get("md5sum", "")
            if not is_md5(md5sum):
                return None
        elif export.subscribers:
            md5sum = await self._definitions.md5sum(type_) or UNKNOWN_MD5
        else:
            return None
        rewriter = await self._definitions.rewriter(type_, md5sum) if self._rules.has_frames else None

        return TopicToken(
            self.claim.name,
            self.claim.gateway,
            export.topic,
            type_,
            md5sum,
            bool(headers),
            bool(export.subscribers),
            any(header.get("latching") == "1" for header in headers),
            rewriter is not None,
        )

    async def _look_at_publishers(self, exports: dict[str, Export]) -> None:
        """Learn from each new publisher its type, and whether it latches: the master knows neither."""
        present = {(each.topic, node) for each in exports.values() for node in each.publishers}
        self._headers = {key: header for key, header in self._headers.items() if key in present}

        async def probe(topic: str, node: str) -> None:
            async with self._probing:
                try:
                    header = await asyncio.wait_for(
                        self._definitions.texts._header_of(topic, node), _PROBE_SECONDS
                    )
                except (MinirospyError, OSError, asyncio.TimeoutError, ValueError):
                    self._not_before[topic, node] = time.monotonic() + _AGAIN_SECONDS
                else:
                    self._headers[topic, node] = header
                    self._definitions.learn(
                        header.get("type", ""), header.get("md5sum", ""), header.get("message_definition", "")
                    )

        await asyncio.gather(*(probe(*key) for key in self._due(present - self._headers.keys())))

    async def _look_at_services(self, services: dict[str, tuple[str, ...]]) -> None:
        """Learn the types of new services: their nodes alone know them."""
        present = set(services.items())
        self._service_types = {key: found for key, found in self._service_types.items() if key in present}

        async def probe(name: str, nodes: tuple[str, ...]) -> None:
            async with self._probing:
                try:
                    header = await asyncio.wait_for(service_header(self._node, name), _PROBE_SECONDS)
                except (ServiceException, asyncio.TimeoutError):
                    self._not_before[name, nodes] = time.monotonic() + _AGAIN_SECONDS
                    return
            if is_md5(header.get("md5sum", "")) and "/" in header.get("type", ""):
                self._service_types[name, nodes] = header["type"], header["md5sum"]

        await asyncio.gather(*(probe(*key) for key in self._due(present - self._service_types.keys())))

    def _due(self, keys: set[_Key]) -> list[_Key]:
        now = time.monotonic()
        self._not_before = {key: until for key, until in self._not_before.items() if until > now}
        return [key for key in keys if key not in self._not_before]

    # --- what others want, and offer

    def _want_changed(self, key: str, is_there: bool) -> None:
        want = parse_want(key)
        if want is None:
            return
        if is_there and want.topic not in self._readers and len(self._readers) >= _MOST_WANTED:
            return
        readers = self._readers.setdefault(want.topic, set())
        if is_there and len(readers) < _MOST_READERS:
            readers.add(want.reader)
            outbound = self.outbound.get(want.topic)
            if outbound:
                outbound.replay(want.reader)
        else:
            readers.discard(want.reader)
        if not readers:
            del self._readers[want.topic]
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
        best = holder(self._claims)
        was_first, self.duplicates = not self.duplicates, tuple(sorted(self._claims - {self.claim}))
        if best != self.claim and was_first:
            _log.error(
                "a robot of the name [%s] is in the fleet already, on another machine: this one is not shown until that "
                "one leaves, or this one has another name (--name)",
                self.claim.name,
            )

    async def _adjust(self) -> None:
        """Open and close what is sent, and what is published here, as the graph and the wants are."""
        # Closing waits for the master: other calls of this method run meanwhile, and change both tables.
        for topic, outbound in list(self.outbound.items()):
            token = self.topics.get(topic)
            if self.outbound.get(topic) is outbound and (
                token is None or not token.has_same_messages(outbound.token) or topic not in self._readers
            ):
                del self.outbound[topic]
                await outbound.close()

        for topic in list(self._readers):
            token = self.topics.get(topic)
            if token and token.is_published and topic not in self.outbound:
                lane = self._rules.lane(topic, token.type)
                outbound = OutboundTopic(
                    self._node,
                    token,
                    self._sender.flow(lane, self._rules.rate(topic)),
                    await self._definitions.rewriter(token.type, token.md5sum) if token.has_frames else None,
                )
                if topic in self._readers and topic not in self.outbound:
                    self.outbound[topic] = outbound
                    outbound.open()
        for topic, inbound in list(self.inbound.items()):
            token = self.topics.get(topic)
            if self.inbound.get(topic) is inbound and (
                token is None or not token.is_subscribed or inbound.is_idle
            ):
                del self.inbound[topic]
                await inbound.close()

    # --- messages, calls and questions of others

    def _inbound_of(self, topic: str) -> InboundTopic | None:
        """Return the publisher for what comes to a topic, which must be subscribed here."""
        inbound = self.inbound.get(topic)
        token = self.topics.get(topic)
        if inbound is None and token is not None and token.is_subscribed:
            inbound = self.inbound[topic] = InboundTopic(
                self._node, self._definitions, token, self._spawn, self._rules.has_frames
            )
        return inbound

    def _arrived(self, key: str, message: bytes, attachment: bytes) -> None:
        """Take a message for this robot. In a thread of Zenoh's."""
        parsed = parse_in(key)
        token = self.topics.get(parsed[0]) if parsed else None
        if parsed is None or token is None or not token.is_subscribed:
            return
        topic, md5sum, writer = parsed
        flow = self._flows.of((topic, writer))
        if flow is not None:
            self._intake.add(
                flow, lambda body, _: self._deliver(topic, md5sum, writer, body), message, attachment
            )

    def _deliver(self, topic: str, md5sum: str, writer: str, body: bytes) -> None:
        """Publish a message. In the intake's thread."""
        inbound = self.inbound.get(topic)
        if inbound is None or not inbound.publish(md5sum, body):
            loop = self._node._loop
            assert loop
            # Waits: messages that come faster than the loop takes them stay in the intake's queue.
            done = asyncio.run_coroutine_threadsafe(self._hold(topic, md5sum, writer, body), loop)
            with contextlib.suppress(Exception):
                done.result(10.0)

    async def _hold(self, topic: str, md5sum: str, writer: str, body: bytes) -> None:
        inbound = self._inbound_of(topic)
        if inbound:
            inbound.hold(md5sum, writer, body)

    async def _call(self, key: str, request: bytes) -> bytes:
        parsed = parse_call(key)
        token = self.services.get(parsed[0]) if parsed else None
        if parsed is None or token is None:
            raise QueryFailed("the robot has no such service")
        if token.md5sum != parsed[1]:
            raise QueryFailed(f"the service has the md5sum {token.md5sum}, not {parsed[1]}")
        try:
            return await call_raw(self._node, token.service, token.md5sum, request)
        except ServiceException as error:
            raise QueryFailed(str(error)) from error

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
        """Return the part of a namespace that may be read."""
        found: dict[str, object] = {}
        for key, value in tree.items():
            full = f"{name.rstrip('/')}/{key}"
            if isinstance(value, dict):
                found[key] = self._allowed(full, value)
            elif self._rules.parameters(full):
                found[key] = value
        return found
