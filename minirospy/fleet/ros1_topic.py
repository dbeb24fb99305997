"""A topic that is forwarded in both directions between the local graph and bridges that use zenoh-bridge-ros1's keys."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import TYPE_CHECKING

from minirospy.core.wire.header import Header
from minirospy.fleet.definitions import Definitions
from minirospy.fleet.inbound import InboundTopic, run_on_loop
from minirospy.fleet.keys import Offer
from minirospy.fleet.network import Deferred, FleetNetwork
from minirospy.fleet.outbound import OutboundTopic
from minirospy.fleet.ros1_keys import SharedTopic, data_key
from minirospy.fleet.rules import GatewayRules
from minirospy.fleet.sender import Receiver, Sender

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["MARK", "Ros1Topic", "Shared"]

MARK = "ros1_keys"
"""Connection header field of the publishers that a gateway creates for zenoh-bridge-ros1's keys.

No gateway sends these publishers' messages back to the keys.
"""

_REPLAY_SECONDS = 0.5
"""Seconds between a subscriber's first beacon and the replay of latched messages.

The subscriber's bridge may subscribe only after the beacon.
"""
_WRITER = ""


@dataclass
class Shared:
    """Objects shared by all topics on zenoh-bridge-ros1's keys."""

    node: Node
    network: FleetNetwork
    definitions: Definitions
    sender: Sender
    receiver: Receiver
    rules: GatewayRules
    namespace: str
    spawn: Callable[[Coroutine[object, object, None]], object]


class Ros1Topic:
    """A topic with a single type. Runs on the loop; other threads handle its messages."""

    def __init__(self, shared: Shared, topic: SharedTopic) -> None:
        self.token = topic.token
        self.inbound: InboundTopic | None = None
        self.outbound: OutboundTopic | None = None
        self._shared = shared
        self._topic = topic._replace(is_offered=False, is_wanted=False)
        self._key = data_key(self.token.type, self.token.md5sum, self.token.topic, shared.namespace)
        self._flow = Receiver.flow()
        self._matching: Deferred | None = None
        self._is_matched = False
        self._subscribed: Deferred | None = None
        self._replaying: asyncio.TimerHandle | None = None
        self._is_closed = False

    async def update(self, topic: SharedTopic) -> None:
        """Open and close handles after the topic's local or remote use has changed."""
        before, self._topic = self._topic, topic
        self.token = topic.token
        if topic.is_wanted and not before.is_wanted and self.outbound:
            self._replay_soon()
        if topic.is_offered != before.is_offered:
            token = topic.token
            offer = Offer(token.topic, _WRITER, token.type, token.md5sum, is_latched=False)
            self._inbound().offer_changed(offer, topic.is_offered)
        inbound = self.inbound
        if inbound and inbound.is_idle:
            self.inbound = None
            await inbound.close()
        self._adjust()
        outbound = self.outbound
        if outbound and not self._is_sent:
            self.outbound = None
            await outbound.close()

    async def close(self) -> None:
        """Stop forwarding messages. Idempotent."""
        self._is_closed = True
        if self._replaying:
            self._replaying.cancel()
        for declared in (self._matching, self._subscribed):
            if declared:
                declared.undeclare()
        self._matching = self._subscribed = None
        inbound, outbound = self.inbound, self.outbound
        self.inbound = self.outbound = None
        if inbound:
            await inbound.close()
        if outbound:
            await outbound.close()

    @property
    def _is_sent(self) -> bool:
        return self._topic.is_wanted or (self.token.is_published and self._is_matched)

    def _adjust(self) -> None:
        """Open the handles that are needed now, and close those that can be closed without an await."""
        if self._is_closed:
            return
        shared, token = self._shared, self.token
        # Use Zenoh to detect readers: it reports all of them, whereas silent bridges and third-party programs send no beacons.
        if token.is_published and self._matching is None:
            self._matching = shared.network.watch_matching(self._key, self._matching_changed)
        elif not token.is_published and self._matching:
            self._matching.undeclare()
            self._matching, self._is_matched = None, False
        if self._is_sent and self.outbound is None:
            flow = shared.sender.flow(
                shared.rules.priority(token.topic, token.type), shared.rules.rate(token.topic), is_bare=True
            )
            self.outbound = OutboundTopic(shared.node, token, flow, key=self._key, is_left_out=_is_marked)
            self.outbound.open()

        is_read = token.is_subscribed or (self.inbound is not None and self.inbound.has_subscribers)
        if is_read and self._subscribed is None:
            self._subscribed = shared.network.subscribe(self._key, self._arrived, from_others=True)
        elif not is_read and self._subscribed:
            self._subscribed.undeclare()
            self._subscribed = None

    def _matching_changed(self, is_matched: bool) -> None:
        self._is_matched = is_matched
        if is_matched and self.outbound:
            self._replay_soon()
        self._adjust()

    def _replay_soon(self) -> None:
        if self._replaying:
            self._replaying.cancel()

        def replay() -> None:
            if self.outbound:
                self.outbound.replay(self._key)

        self._replaying = asyncio.get_running_loop().call_later(_REPLAY_SECONDS, replay)

    # --- messages from other bridges

    def _inbound(self) -> InboundTopic:
        shared = self._shared
        if self.inbound is None:
            self.inbound = InboundTopic(
                shared.node,
                shared.definitions,
                self.token,
                shared.spawn,
                strips_frames=False,
                headers={MARK: "1"},
                on_change=self._adjust,
                stop_seconds=shared.rules.stop_seconds,
            )
        return self.inbound

    def _arrived(self, _: str, message: bytes, __: bytes) -> None:
        """Queue an inbound message. Runs in one of Zenoh's threads."""
        self._shared.receiver.add(self._flow, self._deliver, message, b"")

    def _deliver(self, message: bytes, _: bytes) -> None:
        """Publish an inbound message locally. Runs in the receiver's thread."""
        inbound = self.inbound
        if inbound is None or not inbound.publish(self.token.md5sum, message):
            run_on_loop(self._shared.node, self._hold(message))

    async def _hold(self, message: bytes) -> None:
        if not self._is_closed:
            self._inbound().keep(self.token.md5sum, _WRITER, message)


def _is_marked(header: Header) -> bool:
    return MARK in header
