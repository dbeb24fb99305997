"""The zenoh-bridge-ros1 half of a gateway: shares topics and services with robots that use that bridge.

Topics and services have the same names on both sides.
"""

from __future__ import annotations

import asyncio
import io
import logging
import random
import threading
import time
from collections.abc import Callable, Collection, Coroutine
from dataclasses import replace
from typing import TYPE_CHECKING

from minirospy.aio.raw import RawService, RawSubscription
from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.base.errors import BridgeError, DeserializationError, MinirospyError, ServiceException
from minirospy.base.name_filter import NameFilter
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.fleet.definitions import Definitions
from minirospy.fleet.inbound import call_service
from minirospy.fleet.keys import UNKNOWN_MD5, Claim, ServiceToken
from minirospy.fleet.network import Beacon, Deferred, FleetNetwork, QueryFailed
from minirospy.fleet.robot_graph import RobotGraph
from minirospy.fleet.ros1_keys import (
    PERIOD,
    Beacons,
    Resource,
    Sightings,
    beacon_key,
    beacon_pattern,
    data_key,
    parse_beacon,
    shared_topics,
)
from minirospy.fleet.ros1_topic import Ros1Topic, Shared
from minirospy.fleet.rules import GatewayRules, is_logger_service
from minirospy.fleet.sender import Receiver, Sender
from minirospy.introspect.snapshot import Snapshot
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["Ros1Side"]

_log = logging.getLogger(__name__)
_MARKER = "/minirospy/ros1_keys"
"""The topic to which gateways that use zenoh-bridge-ros1's keys subscribe first, so that they detect each other."""
_MARKER_TYPE = InterfaceType("std_msgs/Empty", "d41d8cd98f00b204e9800998ecf8427e")
_BRIDGE = "/ros1_to_zenoh_bridge"  # prefix of the default node names of zenoh-bridge-ros1
_AGGREGATE = "/rosout_agg"
_BEAT_SECONDS = 0.2
_CALL_SECONDS = 3600.0
_MAX_REASON = 200
_MAX_ERROR = 2_000


class Ros1Side:
    """Connects a master to zenoh-bridge-ros1's keys: forwards topics and services.

    Runs on the node's loop, except that messages and beacons are handled in other threads.
    """

    def __init__(
        self,
        node: Node,
        network: FleetNetwork,
        definitions: Definitions,
        sender: Sender,
        receiver: Receiver,
        claim: Claim,
        rules: GatewayRules,
        namespace: str,
        hidden: Callable[[], Collection[str]],
        spawn: Callable[[Coroutine[object, object, None]], object],
    ) -> None:
        """Create this half of the bridge.

        ``hidden()`` returns the names of the imported robots; ``namespace`` is the keys' namespace.
        """
        # Exclude /rosout_agg, which repeats /rosout: forwarding both would return each log message to its own master.
        if rules.topics == NameFilter():
            rules = replace(rules, topics=NameFilter.of(deny=[_AGGREGATE]))
        self.namespace = namespace
        self.refused = 0  # number of beacons ignored so far
        self.topics: dict[str, Ros1Topic] = {}
        self.services: dict[str, tuple[Resource, RawService]] = {}
        self.graph = RobotGraph(
            node, definitions, claim, replace(rules, has_frames=False), hidden, self._gateways
        )
        self._node = node
        self._network = network
        self._rules = rules
        self._shared = Shared(node, network, definitions, sender, receiver, rules, namespace, spawn)
        self._answered: dict[ServiceToken, Deferred] = {}
        self._outlets: dict[str, Beacon] = {}
        # Guards the data about beacons, which arrive in Zenoh's threads.
        self._lock = threading.Lock()
        self._beacons = Beacons(random.random)
        self.sightings = Sightings()
        self._has_news = False
        self._conflicts: dict[str, str] = {}
        self._others: set[str] = set()
        self._adjusting = asyncio.Lock()
        self._left_out = RateLimitedLogger(_log)
        self._misfits = RateLimitedLogger(_log, 5)
        self._reporter = ErrorReporter(_log, "passing the keys of zenoh-bridge-ros1")
        self._marker: RawSubscription | None = None
        self._beacons_received: Deferred | None = None
        self._tasks: list[asyncio.Task[None]] = []

    async def start(self) -> None:
        """Start to forward topics and services, until :meth:`close`.

        Raise BridgeError if another node on this master already uses these keys, or MasterUnreachableError or RpcError if a
        call to the master fails.
        """
        self._marker = await self._node.subscribe_raw(_MARKER, lambda *_: None, type_=_MARKER_TYPE)
        await self.graph.look()
        if self._others:
            raise BridgeError(
                f"{min(self._others)} passes the keys of zenoh-bridge-ros1 on this master already: end it, or, where it has "
                "crashed, run `rosnode cleanup`"
            )
        await self.look()
        self._beacons_received = self._network.subscribe(
            beacon_pattern(self.namespace), self._beacon_arrived, from_others=True
        )
        self._tasks = [
            asyncio.ensure_future(keep_running(lambda: self.graph.watch(self.look), self._reporter)),
            asyncio.ensure_future(keep_running(self._beat, self._reporter)),
        ]

    async def close(self) -> None:
        """Withdraw all announcements. Idempotent."""
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self.graph.close()
        for declared in (self._beacons_received, *self._outlets.values(), *self._answered.values()):
            if declared:
                declared.undeclare()
        self._beacons_received, self._outlets, self._answered = None, {}, {}
        topics, services, marker = self.topics, self.services, self._marker
        self.topics, self.services, self._marker = {}, {}, None
        await asyncio.gather(
            *(topic.close() for topic in topics.values()),
            *(offered.close() for _, offered in services.values()),
        )
        if marker:
            await marker.close()

    async def look(self) -> bool:
        """Announce the current graph; return whether it has changed.

        Raise MasterUnreachableError or RpcError if the call to the master fails.
        """
        changed = await self.graph.look()
        # Open topics and services before announcing them: a bridge uses them as soon as it receives a beacon.
        await self._adjust()
        self._announce()
        return changed

    def status(self) -> dict[str, object]:
        """Return counters and resources, as JSON-compatible values."""
        with self._lock:
            seen, announced = len(list(self.sightings)), len(self._beacons)
        return {
            "namespace": self.namespace,
            "announced": announced,
            "seen": seen,
            "refused": self.refused,
            "sent": [
                {
                    "topic": name,
                    "messages": each.outbound.outflow.sent,
                    "dropped": each.outbound.outflow.dropped,
                }
                for name, each in self.topics.items()
                if each.outbound
            ],
            "passed_in": [
                {"topic": name, "messages": each.inbound.passed}
                for name, each in self.topics.items()
                if each.inbound
            ],
            "services": list(self.services),
        }

    # --- the local graph

    def _gateways(self, snapshot: Snapshot) -> set[str]:
        """Return the other gateways on this master that use zenoh-bridge-ros1's keys.

        Their publications and subscriptions are not announced again.
        """
        ends = (snapshot.publishers, snapshot.subscribers, snapshot.services)
        bridges = {
            node for table in ends for nodes in table.values() for node in nodes if node.startswith(_BRIDGE)
        }
        found = bridges | set(snapshot.subscribers.get(_MARKER, ())) - {self._node.name}
        for node in sorted(found - self._others) if self._beacons_received else ():
            _log.warning(
                "%s passes the keys of zenoh-bridge-ros1 on this master, too: messages come twice. End one of the two",
                node,
            )
        self._others = found
        return found

    def _announce(self) -> None:
        resources = []
        for topic in self.graph.topics.values():
            if topic.md5sum != UNKNOWN_MD5:
                ends = (("pub", topic.is_published), ("sub", topic.is_subscribed))
                resources += [
                    Resource(kind, topic.topic, topic.type, topic.md5sum)
                    for kind, is_there in ends
                    if is_there
                ]
        resources += [Resource("srv", *token[2:]) for token in self.graph.services.values()]
        keys = [beacon_key(each, self.namespace) for each in resources]
        for key in self._outlets.keys() - set(keys):
            self._outlets.pop(key).undeclare()
        for key in keys:
            if key not in self._outlets:
                self._outlets[key] = self._network.beacon(key)
        with self._lock:
            self._beacons.update(keys, time.monotonic())

    async def _beat(self) -> None:
        """Send the beacons that are due; update topics and services from received beacons."""
        expected = time.monotonic()
        while True:
            now = time.monotonic()
            late, expected = now - expected, now + _BEAT_SECONDS
            with self._lock:
                due = self._beacons.due(now)
                if late > PERIOD:
                    # The process was suspended. Beacons sent meanwhile arrive later, so let the resources expire later, too.
                    self.sightings.extend(late, now)
                has_news = self.sightings.forget_lost(now) or self._has_news
            for key in due:
                self._outlets[key].put()
            if has_news:
                await self._adjust()
            await asyncio.sleep(_BEAT_SECONDS)

    # --- resources of other bridges

    def _beacon_arrived(self, key: str, _: bytes, __: bytes) -> None:
        """Record a beacon. Runs in one of Zenoh's threads."""
        try:
            resource = parse_beacon(key)
            with self._lock:
                self._beacons.received(key)
                if resource and self._allows(resource):
                    self._has_news |= self.sightings.received(resource, time.monotonic())
        except BridgeError as error:
            self.refused += 1
            self._left_out.warning("a beacon of zenoh-bridge-ros1 is left out: %s", str(error)[:_MAX_REASON])

    def _allows(self, resource: Resource) -> bool:
        if resource.kind != "srv":
            return self._rules.topics(resource.name)
        is_shown = self._rules.services != NameFilter() or not is_logger_service(resource.name)
        return is_shown and self._rules.services(resource.name)

    async def _adjust(self) -> None:
        """Open and close topics and services to match the local graph and the received beacons."""
        async with self._adjusting:
            with self._lock:
                remote, self._has_news = list(self.sightings), False
            found, conflicts = shared_topics(self.graph.topics, remote)
            for name in conflicts.keys() - self._conflicts.keys():
                self._misfits.warning("%s of others is not passed: it is of type %s", name, conflicts[name])
            self._conflicts = conflicts

            for name, topic in list(self.topics.items()):
                if name not in found or not found[name].has_type_of(topic.token):
                    await self.topics.pop(name).close()
            for name, shared in found.items():
                if name not in self.topics:
                    self.topics[name] = Ros1Topic(self._shared, shared)
                await self.topics[name].update(shared)
            await self._adjust_services(remote)

    async def _adjust_services(self, remote: list[Resource]) -> None:
        here = set(self.graph.services.values())
        for token in self._answered.keys() - here:
            self._answered.pop(token).undeclare()
        for token in here - self._answered.keys():
            key = data_key(token.type, token.md5sum, token.service, self.namespace)
            self._answered[token] = self._network.answer(key, self._answerer(token), from_others=True)

        # A master stores one provider per service, so a local node's service takes precedence over a remote one.
        there = {each.name: each for each in reversed(remote) if each.kind == "srv"}
        for name, (resource, offered) in list(self.services.items()):
            if there.get(name) != resource or name in self.graph.service_names:
                del self.services[name]
                await offered.close()
        for name, resource in there.items():
            if name not in self.services and name not in self.graph.service_names:
                self.services[name] = resource, self._serve(resource)

    def _answerer(self, token: ServiceToken) -> Callable[[str, bytes], Coroutine[object, object, bytes]]:
        return lambda _, request: call_service(self._node, token, request)

    def _serve(self, resource: Resource) -> RawService:
        key = data_key(resource.type, resource.md5sum, resource.name, self.namespace)

        async def call(request: bytes, _: Header) -> bytes:
            try:
                answer = await self._network.query(key, request, seconds=_CALL_SECONDS, of_others=True)
            except QueryFailed as error:
                raise ServiceException(f"service [{resource.name}] of zenoh-bridge-ros1: {error}") from error
            loop = asyncio.get_running_loop()
            fault = await loop.run_in_executor(None, error_in, resource, answer)
            if fault:
                raise ServiceException(f"service [{resource.name}] of zenoh-bridge-ros1: {fault}")
            return answer

        return RawService(self._node, resource.name, InterfaceType(resource.type, resource.md5sum), call)


def error_in(resource: Resource, answer: bytes) -> str:
    """Return the error message in the reply to a service call, or "" if the call succeeded.

    The bridge sends errors and responses in the same way. If the type is installed locally, a reply is an error if it is text
    and is not exactly one serialized response.
    """
    from minirospy.core.idl.load import get_service_class

    text = answer[:_MAX_ERROR].decode(errors="replace")
    if not answer or len(answer) > _MAX_ERROR or not "".join(text.split()).isprintable():
        return ""
    try:
        found = get_service_class(resource.type)
        if found is None or found._md5sum != resource.md5sum:
            return ""
        response = found._response_class()
        written = io.BytesIO()
        response.deserialize(answer).serialize(written)
    except DeserializationError:
        return text
    except (MinirospyError, ImportError, SyntaxError):
        return ""
    return "" if written.getvalue() == answer else text
