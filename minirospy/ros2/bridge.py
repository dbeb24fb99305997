"""The whole bridge: polls both graphs, and opens and closes links to match."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

from minirospy.aio.raw import RawSubscription, raw_class
from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.aio.topics import Publisher
from minirospy.base.errors import (
    DefinitionError,
    DeserializationError,
    MasterUnreachableError,
    NotFoundError,
    ROSException,
    RpcError,
)
from minirospy.base.name_filter import NameFilter
from minirospy.core.idl.cdr import Transcoder
from minirospy.core.idl.codec import keeps_buffer
from minirospy.core.idl.digest import Lookup, full_text, message_md5
from minirospy.core.idl.load import Catalogue, specs_of_text
from minirospy.core.idl.protocols import Message
from minirospy.core.idl.spec import MessageSpec
from minirospy.core.tf2.statics import MAX_BYTES, MAX_FRAMES, TF_TYPES, StaticTransforms
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.node_queries import NodeQueries
from minirospy.introspect.snapshot import Snapshot, fetch
from minirospy.introspect.type_texts import TypeTexts
from minirospy.ros2.actions import ActionBridge
from minirospy.ros2.layouts import TypesDiffer, ros2_spec, transcoder
from minirospy.ros2.link_table import LinkTable, Pair, pairs
from minirospy.ros2.links import Direction, Link, Ros2Topic, is_bridge, links, marker
from minirospy.ros2.parameters import ParameterBridge
from minirospy.ros2.rules import BUILT_IN, Rules
from minirospy.ros2.services import ServiceBridge
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.ros2.interface import Ros2Handle, Ros2Publisher, Ros2Side

__all__ = ["Ros2Bridge", "Ros2Options"]

_ORIGIN = "ros2_domain"
"""Connection header field of the bridge's publishers: the domain their data comes from. Bridges to that domain ignore them."""
_MIN_REFRESH_INTERVAL = 0.25
QUERY_SECONDS = 3.0
"""Timeout in seconds for querying publishers; after that, topics are bridged even if their publishers have not responded."""
JOIN_SECONDS = 2.0
_JOIN_LOOK = 0.02
_DEPTH = 1000
_DEPTH_OF_LARGE = 20
_ROS1_QUEUE = 1000
"""Queue size in messages for all types but images: large enough that a busy machine may pause without losing messages."""


@dataclass(frozen=True)
class Ros2Options:
    """The bridge's settings.

    ``topics``, ``services`` and ``actions`` are filters that select what to bridge. ``call_seconds`` is the timeout for
    service calls, ``max_refresh_interval`` the seconds between polls while the graphs do not change.
    """

    topics: NameFilter = field(default_factory=NameFilter)
    services: NameFilter = field(default_factory=NameFilter)
    actions: NameFilter = field(default_factory=NameFilter)
    call_seconds: float = 60.0
    rules: Rules = BUILT_IN
    max_refresh_interval: float = 1.0


class _Types:
    """Caches specs, interface types and transcoders, keyed by the types of both sides."""

    def __init__(self, side: Ros2Side, rules: Rules, catalogue: Catalogue) -> None:
        self._side = side
        self._rules = rules
        self._catalogue = catalogue
        self._ros2 = lru_cache(maxsize=None)(self._ros2_spec)

    def interface(self, spec: MessageSpec, lookup: Lookup) -> InterfaceType:
        """Return the type information that a connection header contains."""
        return InterfaceType(spec.full_name, message_md5(spec, lookup), full_text(spec, lookup))

    def installed(self, name: str) -> tuple[MessageSpec, Lookup]:
        """Return a message type. Raise TypesDiffer, the error for incompatible types, if the type is not installed."""
        try:
            return self._catalogue.message(name), self._catalogue.message
        except (NotFoundError, DefinitionError) as error:
            raise TypesDiffer(
                f"[{name}] is not defined here: put its package on ROS_PACKAGE_PATH ({error})"
            ) from error

    def of_text(self, name: str, text: str) -> tuple[MessageSpec, Lookup]:
        """Parse a publisher's full definition. Raise TypesDiffer if it is invalid."""
        try:
            specs = specs_of_text(name, text)
        except DefinitionError as error:
            raise TypesDiffer(str(error)) from error

        def lookup(inner: str) -> MessageSpec:
            if inner not in specs:
                raise TypesDiffer(f"the publisher's definition of [{name}] lacks [{inner}]")
            return specs[inner]

        return specs[name], lookup

    def transcoder(self, spec: MessageSpec, lookup: Lookup, ros2_type: str) -> Transcoder:
        """Return functions that convert a message type. Raise TypesDiffer if the types cannot be converted."""
        allowed = self._rules.ros2_messages(spec.full_name)
        if ros2_type not in allowed:
            raise TypesDiffer(f"no rule makes [{spec.full_name}] a [{ros2_type}]: write one for --rules")
        return transcoder(spec, lookup, self._ros2(ros2_type), self._ros2, self._rules)

    def _ros2_spec(self, name: str) -> MessageSpec:
        return ros2_spec(name, self._side.fields(name))


class Ros2Bridge:
    """Bridges topics used on both sides, services and actions offered on one side, and parameters.

    Runs on the node's loop, but ROS 2 messages are forwarded in the thread of ROS 2's executor.
    """

    def __init__(self, node: Node, side: Ros2Side, options: Ros2Options, catalogue: Catalogue) -> None:
        self.node = node
        self.side = side
        self.options = options
        self.topics: LinkTable[Link, _ToRos1 | PassingToRos2] = LinkTable(node.log, self._make)
        self.header = marker("")
        self.services = ServiceBridge(
            node, side, options.services, options.rules, catalogue, options.call_seconds
        )
        self.actions = ActionBridge(node, side, options.actions, options.rules, catalogue)
        self._parameters = ParameterBridge(node, side, catalogue)
        self._types = _Types(side, options.rules, catalogue)
        self._texts = TypeTexts(node)
        reporter = ErrorReporter(node.log, "the query of a publisher")
        self._headers = NodeQueries(self._header, reporter)
        self._watching: asyncio.Task[None] | None = None
        self._changed = asyncio.Event()
        self._is_closed = False

    async def start(self) -> None:
        """Start to bridge both sides, until :meth:`close`.

        Raise MasterUnreachableError or RpcError if a call to the master fails.
        """
        await self._parameters.start()
        await self.look()
        reporter = ErrorReporter(self.node.log, "the watch of both graphs")
        self._watching = asyncio.ensure_future(keep_running(self._watch, reporter))

    async def close(self) -> None:
        """Close all links and the ROS 2 backend. Idempotent."""
        self._is_closed = True
        watching, self._watching = self._watching, None
        if watching:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
        await self.topics.close()
        await self.actions.close()
        await self.services.close()
        await self._parameters.close()
        await self._headers.close()
        await self._texts.close()
        await asyncio.get_running_loop().run_in_executor(None, self.side.close)

    async def pairs(self) -> list[Pair]:
        """Return the links that should be bridged, without opening them, each with the reason if that is impossible.

        Raise the same errors as :meth:`look`.
        """
        snapshot = await self._snapshot()
        topics = pairs(await self._wanted(snapshot), self._converter)
        return [*topics, *await self.services.pairs(snapshot.services), *self.actions.pairs(snapshot)]

    async def wait_for(self, condition: Callable[[], bool]) -> None:
        """Wait until ``condition()`` is true; check it after each refresh."""
        while not condition():
            await self._changed.wait()

    async def look(self) -> bool:
        """Open and close links to match the graphs. Return whether any link was opened or closed.

        Raise MasterUnreachableError or RpcError if a call to the master fails.
        """
        snapshot = await self._snapshot()
        has_changed = await self.topics.update(await self._wanted(snapshot))
        has_changed |= await self.services.look(snapshot.services)
        has_changed |= await self.actions.look(snapshot)
        self._changed.set()
        self._changed = asyncio.Event()
        return has_changed

    async def _watch(self) -> None:
        pause = _MIN_REFRESH_INTERVAL
        is_reported = False
        # Check the flag, because wait_for, which these methods call, may swallow a cancellation in Python 3.11.
        while not self._is_closed:
            await asyncio.sleep(pause)
            changed = False
            try:
                changed = await self.look()
                is_reported = False
            except (MasterUnreachableError, RpcError) as error:
                if not is_reported:
                    self.node.log.warning("the graph cannot be read: %s. Will keep trying.", error)
                is_reported = True
            slowest = max(self.options.max_refresh_interval, _MIN_REFRESH_INTERVAL)
            pause = _MIN_REFRESH_INTERVAL if changed else min(pause * 1.5, slowest)

    async def _snapshot(self) -> Snapshot:
        """Return the ROS 1 graph; store its run_id."""
        snapshot = await fetch(self.node.call_master)
        run_id = await self.node.get_param("/run_id", "")
        self.header = marker(str(run_id))
        return snapshot

    async def _wanted(self, snapshot: Snapshot) -> list[Link]:
        """Return the topics to bridge in the current graphs."""
        names = self.side.topics()
        ros2 = {
            name: self.side.ends(name)
            for name in names
            if name in snapshot.topics and self.options.topics(name)
        }
        await self._look_at_publishers(snapshot, ros2)
        return links(snapshot, ros2, self._is_latched, self.options.rules.ros1_message)

    async def _look_at_publishers(self, snapshot: Snapshot, ros2: Mapping[str, Ros2Topic]) -> None:
        """If a topic has ROS 2 subscribers, ask its new ROS 1 publishers for their definitions, and whether they latch."""
        present = [
            (topic, node)
            for topic, ends in ros2.items()
            if ends.subscribers
            for node in snapshot.publishers.get(topic, ())
            if not is_bridge(node)
        ]
        await self._headers.look(present, QUERY_SECONDS)

    async def _header(self, key: tuple[str, str]) -> Header:
        return await self._texts.header_of(*key)

    def _is_latched(self, topic: str, node: str) -> bool:
        return self._headers.found.get((topic, node), {}).get("latching") == "1"

    def _converter(self, link: Link) -> tuple[Transcoder, MessageSpec, Lookup]:
        """Return functions that convert a link's messages. Raise TypesDiffer if the types cannot be converted."""
        texts = [
            header.get("message_definition", "")
            for (topic, _), header in self._headers.found.items()
            if topic == link.topic and header.get("type") == link.ros1_type
        ]
        text = next(filter(None, texts), "") if link.direction is Direction.TO_ROS2 else ""
        if text:
            spec, lookup = self._types.of_text(link.ros1_type, text)
        else:
            spec, lookup = self._types.installed(link.ros1_type)
        return self._types.transcoder(spec, lookup, link.ros2_type), spec, lookup

    def _make(self, link: Link) -> _ToRos1 | PassingToRos2:
        made, spec, lookup = self._converter(link)
        depth = _DEPTH_OF_LARGE if keeps_buffer(spec, lookup) else _DEPTH
        if link.direction is Direction.TO_ROS2:
            return PassingToRos2(self, link, made, depth)
        return _ToRos1(self, link, made, depth, self._types.interface(spec, lookup))


class TopicPassing:
    """An open link for a topic; ``passed`` counts the forwarded messages."""

    def __init__(self, bridge: Ros2Bridge, link: Link, made: Transcoder) -> None:
        self.link = link
        self.passed = 0
        self._bridge = bridge
        self._made = made
        self._misfits = RateLimitedLogger(bridge.node.log)
        is_static = link.is_latched and link.ros1_type in TF_TYPES
        self._statics = StaticTransforms() if is_static else None

    def _with_statics(self, message: Frame) -> Frame:
        """Return the message to send. For a topic with static transforms, include all known static transforms."""
        if self._statics is None:
            return message
        left_out = self._statics.left_out
        merged = self._statics.merged(message)
        if self._statics.left_out != left_out:
            self._misfits.warning(
                "%s (%s): more than %d frames or %d bytes of static transforms: new frames are not passed on",
                self.link.topic,
                self.link.direction.value,
                MAX_FRAMES,
                MAX_BYTES,
            )
        return merged

    def _report(self, error: Exception) -> None:
        self._misfits.error("a message on %s (%s): %s", self.link.topic, self.link.direction.value, error)


class PassingToRos2(TopicPassing):
    def __init__(self, bridge: Ros2Bridge, link: Link, made: Transcoder, depth: int) -> None:
        super().__init__(bridge, link, made)
        self._publisher: Ros2Publisher = bridge.side.publisher(
            link.topic, link.ros2_type, depth=1 if link.is_latched else depth, is_latched=link.is_latched
        )
        self._subscription: RawSubscription | None = None

    async def open(self) -> None:
        await self._wait_for_subscribers()
        self._subscription = self._bridge.node.subscribe_raw(self.link.topic, self._deliver)

    async def close(self) -> None:
        if self._subscription:
            await self._subscription.close()
        self._publisher.close()

    async def _wait_for_subscribers(self) -> None:
        """Wait at most two seconds until a subscriber is connected, because it would miss messages that are published earlier."""
        loop = asyncio.get_running_loop()
        end = loop.time() + JOIN_SECONDS
        while not self._publisher.subscribers and loop.time() < end:
            await asyncio.sleep(_JOIN_LOOK)

    def _deliver(self, frame: Frame, header: Header) -> None:
        bridge = self._bridge
        if header.get("callerid") == bridge.node.name or header.get(_ORIGIN) == bridge.side.domain:
            return
        try:
            frame = self._with_statics(frame)
            self._publisher.publish(self._made.to_cdr(frame, bridge.header))
        except DeserializationError as error:
            self._report(error)
        else:
            self.passed += 1


class _ToRos1(TopicPassing):
    def __init__(
        self, bridge: Ros2Bridge, link: Link, made: Transcoder, depth: int, interface: InterfaceType
    ) -> None:
        super().__init__(bridge, link, made)
        self._depth = _DEPTH if link.is_latched else depth
        self._publisher: Publisher[Message] = bridge.node.advertise(
            link.topic,
            raw_class(interface),
            queue_size=_DEPTH_OF_LARGE if depth == _DEPTH_OF_LARGE else _ROS1_QUEUE,
            latch=link.is_latched,
            headers={_ORIGIN: bridge.side.domain},
        )
        self._subscription: Ros2Handle | None = None

    async def open(self) -> None:
        await self._publisher.wait_for_expected()
        self._subscription = self._bridge.side.subscribe(
            self.link.topic,
            self.link.ros2_type,
            self._deliver,
            depth=self._depth,
            is_reliable=self.link.is_reliable,
            is_latched=self.link.is_latched,
        )

    async def close(self) -> None:
        if self._subscription:
            self._subscription.close()
        await self._publisher.close()

    def _deliver(self, data: bytes) -> None:
        """Send a message to ROS 1. Runs in the executor's thread, which writes to the ROS 1 sockets directly."""
        if data[2:4] == self._bridge.header[2:4]:
            return  # another bridge to this ROS 1 graph has sent the message
        try:
            self._publisher.publish_raw(bytes(self._with_statics(self._made.to_ros1(data))))
        except DeserializationError as error:
            self._report(error)
        except ROSException:
            return  # the link was closed in the meantime
        else:
            self.passed += 1
