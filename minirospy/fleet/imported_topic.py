"""A robot's topic in the local graph.

The topic is published locally while it has local subscribers, and offered to the robot while it has local publishers.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from minirospy.aio.raw import RawSubscription, raw_class
from minirospy.aio.topics import Publisher
from minirospy.base.errors import DeserializationError, ROSException
from minirospy.core.idl.protocols import Message
from minirospy.core.tf2.statics import TF_TYPES, StaticTransforms
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.fleet.clocks import ClockOffset, Delay
from minirospy.fleet.definitions import Definitions
from minirospy.fleet.keys import (
    UNKNOWN_MD5,
    Offer,
    TopicToken,
    Want,
    in_key,
    is_md5,
    offer_key,
    out_key,
    parse_stamp,
    replay_key,
    want_key,
)
from minirospy.fleet.network import Deferred, FleetNetwork
from minirospy.fleet.rules import GatewayRules
from minirospy.fleet.sender import Outflow, Receiver, Sender
from minirospy.introspect.snapshot import Snapshot
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["ImportedTopic", "Shared"]

_log = logging.getLogger(__name__)
_LINGER_SECONDS = 1.0
_QUEUE = 100
_FRAME_TOPICS = ("/tf", "/tf_static")
_MAX_MESSAGE = 256 << 20
_MAX_OFFERS = 10
# maximum number of concurrent registrations; each uses a separate connection to the master
MAX_REGISTERING = 50


@dataclass
class Shared:
    """Objects that all topics of the importer share."""

    node: Node
    network: FleetNetwork
    definitions: Definitions
    sender: Sender
    receiver: Receiver
    gateway: str
    rules: GatewayRules
    spawn: Callable[[Coroutine[object, object, None]], object]
    clock: Callable[[], int]
    left_out: RateLimitedLogger
    """Logs topics that cannot be imported."""
    registering: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(MAX_REGISTERING))
    statics: dict[str, StaticTransforms] = field(default_factory=dict)


class ImportedTopic:
    """A topic of one robot, imported into the local graph. Runs on the loop; other threads handle its messages."""

    def __init__(self, shared: Shared, token: TopicToken, offset: Callable[[], ClockOffset | None]) -> None:
        """Create the topic. ``offset()`` returns the offset of the robot's clock, or None before it has been measured."""
        self.token = token
        is_global = token.has_frames and token.topic in _FRAME_TOPICS
        self.name = token.topic if is_global else f"/{token.robot}{token.topic}"
        self.received = 0
        self.lost = 0
        self.delay = Delay()
        self._is_global = is_global
        self._shared = shared
        self._offset = offset
        self._flow = Receiver.flow()
        self._numbers: dict[str, int] = {}
        self._misfits = RateLimitedLogger(_log)
        self._publisher: Publisher[Message] | None = None
        self._statics: StaticTransforms | None = None
        self._wanted: list[Deferred] = []
        self._unwanting: asyncio.TimerHandle | None = None
        self._subscription: RawSubscription | None = None
        self._offers: dict[tuple[str, bool], Deferred] = {}
        self._outflow: Outflow | None = None
        self._is_closed = False

    @property
    def is_open(self) -> bool:
        """Return whether messages from the robot are being forwarded."""
        return bool(self._wanted)

    @property
    def needs_snapshot(self) -> bool:
        """Return whether a graph snapshot is needed to detect other local publishers of the topic.

        This is the case if this gateway publishes the topic itself.
        """
        return self.token.is_subscribed and self.token.is_published and not self._is_global

    @property
    def dropped(self) -> int:
        """Return how many of the robot's messages were dropped because local subscribers were too slow."""
        return self._flow.dropped

    @property
    def outflow(self) -> Outflow | None:
        """Return the flow of messages to the robot."""
        return self._outflow

    def start(self) -> None:
        """Register the topic with the master."""
        self._shared.spawn(self._open())

    def update(self, token: TopicToken) -> bool:
        """Apply a changed token. Return False if the topic must be closed and created again."""
        before, self.token = self.token, token
        if token == before:
            return True
        if token.is_published != before.is_published or token.type != before.type:
            return False
        if token.is_published and not token.has_same_messages(before):
            return False
        if token.is_latched and not before.is_latched:
            return False
        if not token.is_subscribed:
            self._shared.spawn(self._unsubscribe())
        elif not token.is_published:
            self._subscribe()
        return True

    def look(self, snapshot: Snapshot | None) -> None:
        """Update the topic to match the current local graph."""
        if self._is_closed:
            return
        if self.needs_snapshot and snapshot is not None:
            own = self._shared.node.name
            others = [node for node in snapshot.publishers.get(self.name, ()) if node != own]
            if others:
                self._subscribe()
            elif self._subscription:
                self._shared.spawn(self._unsubscribe())
        self._offer()

    async def close(self) -> None:
        """Unregister the topic. Idempotent."""
        self._is_closed = True
        self._unwant()
        await self._unsubscribe()
        publisher, self._publisher = self._publisher, None
        if publisher:
            if self._links_changed in publisher.on_change:
                publisher.on_change.remove(self._links_changed)
            await publisher.close()

    async def _open(self) -> None:
        shared, token = self._shared, self.token
        if token.is_published:
            interface = await shared.definitions.interface(token.type, token.md5sum, token.gateway)
        async with shared.registering:
            if self._is_closed:
                return
            if token.is_published:
                self._advertise(interface)
            elif token.is_subscribed:
                self._subscribe()
            # Limit the concurrent calls: a thousand robots need 8,000, which the master handles one at a time.
            handle = self._publisher or self._subscription
            if handle is not None:
                await handle.wait_until_registered()

    def _advertise(self, interface: InterfaceType) -> None:
        shared, token = self._shared, self.token
        try:
            self._publisher = shared.node.advertise(
                self.name,
                raw_class(interface),
                queue_size=_QUEUE,
                latch=token.is_latched,
                on_change=self._links_changed,
            )
        except ValueError as error:
            shared.left_out.warning("%s is not shown: %s", self.name, error)
            return
        if token.is_latched and token.type in TF_TYPES:
            made = StaticTransforms()
            self._statics = shared.statics.setdefault(self.name, made) if self._is_global else made
        self._links_changed()

    # --- messages from the robot

    def _links_changed(self) -> None:
        """Request the topic from the robot while local nodes other than this gateway subscribe to it."""
        publisher = self._publisher
        if publisher is None or self._is_closed:
            return
        if any(peer != self._shared.node.name for peer in publisher.subscribers):
            if self._unwanting:
                self._unwanting.cancel()
                self._unwanting = None
            if not self._wanted:
                self._want()
        elif self._wanted and self._unwanting is None:
            loop = asyncio.get_running_loop()
            self._unwanting = loop.call_later(_LINGER_SECONDS, self._unwant)

    def _want(self) -> None:
        shared, token = self._shared, self.token
        ends = token.robot, token.gateway
        network = shared.network
        # Declare the token last, because the robot starts sending as soon as the token appears.
        self._wanted = [
            network.subscribe(out_key(*ends, token.md5sum, token.topic), self._arrived),
            network.subscribe(replay_key(*ends, token.md5sum, token.topic, shared.gateway), self._arrived),
            network.declare_token(want_key(*ends, Want(token.topic, shared.gateway))),
        ]

    def _unwant(self) -> None:
        if self._unwanting:
            self._unwanting.cancel()
            self._unwanting = None
        wanted, self._wanted = self._wanted, []
        for declared in reversed(wanted):
            declared.undeclare()
        self._numbers.clear()
        if wanted and self._publisher and not self._is_global:
            # Forget the local copy, which may become outdated: the robot resends its latched message to the next subscriber.
            self._publisher.forget_latched()

    def _arrived(self, key: str, message: bytes, attachment: bytes) -> None:
        """Queue a message from the robot. Runs in one of Zenoh's threads."""
        if len(message) > _MAX_MESSAGE:
            self._misfits.error(
                "a message on %s of %d bytes is left out: it is too large", self.name, len(message)
            )
            return
        is_replay = key.startswith(_REPLAY)
        self._shared.receiver.add(
            self._flow, self._deliver_replay if is_replay else self._deliver, message, attachment
        )

    def _deliver_replay(self, message: bytes, attachment: bytes) -> None:
        self._publish(message)

    def _deliver(self, message: bytes, attachment: bytes) -> None:
        """Publish a message from the robot locally. Runs in the receiver's thread."""
        stamp = parse_stamp(attachment)
        if stamp:
            before = self._numbers.get("out")
            self._numbers["out"] = stamp.number
            # Ignore a step back or a huge step forward in the sequence numbers: they restart when the robot reopens the topic.
            if before is not None and before < stamp.number <= before + 1_000_000:
                self.lost += stamp.number - before - 1
            offset = self._offset()
            if offset is not None:
                self.delay.add(self._shared.clock() - (stamp.nanoseconds - offset.offset))
        self._publish(message)

    def _publish(self, message: bytes) -> None:
        publisher = self._publisher
        if publisher is None:
            return
        self.received += 1
        try:
            publisher.publish_raw(self._statics.merged(message) if self._statics else message)
        except DeserializationError as error:
            self._misfits.error("a message on %s: %s", self.name, error)
        except ROSException:
            return  # the loop has closed the topic in the meantime

    # --- messages to the robot

    def _subscribe(self) -> None:
        if self._subscription or self._is_closed or self._is_global:
            return
        shared, token = self._shared, self.token
        if self._outflow is None:
            priority = shared.rules.priority(self.name, token.type)
            self._outflow = shared.sender.flow(priority, shared.rules.rate(self.name))
        md5sum = ANY if token.md5sum == UNKNOWN_MD5 else token.md5sum
        self._subscription = shared.node.subscribe_raw(
            self.name, self._heard, type_=InterfaceType(token.type, md5sum), on_change=self._offer
        )

    async def _unsubscribe(self) -> None:
        # Clear all attributes before the await: meanwhile, the topic may be subscribed to again, with a new outflow.
        subscription, self._subscription = self._subscription, None
        offers, self._offers = self._offers, {}
        outflow, self._outflow = self._outflow, None
        for declared in offers.values():
            declared.undeclare()
        if outflow:
            outflow.close()
        if subscription:
            await subscription.close()

    def _offer(self) -> None:
        """Offer the topic to the robot while local nodes other than this gateway publish it."""
        subscription = self._subscription
        if subscription is None:
            return
        present = {
            (header.get("md5sum", ""), header.get("latching") == "1")
            for header in subscription.headers
            if self._is_foreign(header)
        }
        for key in self._offers.keys() - present:
            self._offers.pop(key).undeclare()
        for md5sum, is_latched in list(present - self._offers.keys())[:_MAX_OFFERS]:
            token, shared = self.token, self._shared
            offer = Offer(token.topic, shared.gateway, token.type, md5sum, is_latched)
            self._offers[md5sum, is_latched] = shared.network.declare_token(
                offer_key(token.robot, token.gateway, offer)
            )

    def _heard(self, frame: Frame, header: Header) -> None:
        outflow = self._outflow
        if outflow is None or not self._is_foreign(header):
            return
        self._offer()
        token = self.token
        md5sum = header["md5sum"]
        # Store the definition, so that peers can request a type that is installed only on this machine.
        self._shared.definitions.learn(token.type, md5sum, header.get("message_definition", ""))
        key = in_key(token.robot, token.gateway, md5sum, token.topic, self._shared.gateway)
        outflow.send(key, bytes(frame), always=header.get("latching") == "1")

    def _is_foreign(self, header: Header) -> bool:
        return header.get("callerid") != self._shared.node.name and is_md5(header.get("md5sum", ""))


_REPLAY = replay_key("x", "x", "x", "x", "x").partition("x")[0]
