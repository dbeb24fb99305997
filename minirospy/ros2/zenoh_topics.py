"""ROS 2 publishers and subscriptions over Zenoh, also used by actions. Callbacks run in Zenoh's threads."""

from __future__ import annotations

import contextlib
import importlib
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

from minirospy.ros2.zenoh_keys import Entity, Kind
from minirospy.ros2.zenoh_node import Handle, ZenohNode
from minirospy.zenoh.library import Outlet

if TYPE_CHECKING:
    from minirospy.zenoh.library import Declared, Sample

__all__ = ["ZenohPublisher", "subscribe"]

_log = logging.getLogger(__name__)


class ZenohPublisher(Handle):
    """A publisher that uses its endpoint's QoS settings."""

    def __init__(self, node: ZenohNode, end: Entity) -> None:
        outlet = _outlet(node, end)
        super().__init__(node, end, outlet)
        self._graph = node.graph
        self._end = end
        self._outlet = outlet

    @property
    def subscribers(self) -> int:
        """Return the number of known subscribers, or 0 if a message sent now would not reach them."""
        found = self._graph.of_name(self._end.name, Kind.SUBSCRIPTION)
        count = len([each for each in found if each.key == self._end.key])
        # A transient local publisher stores its messages, so no message is lost.
        is_ready = self._end.qos.is_transient_local or self._outlet.matching_status.matching
        return count if is_ready else 0

    def publish(self, data: bytes) -> None:
        """Send a message; drop it if the network is too slow."""
        # The session may already be closed.
        with contextlib.suppress(self._fault):
            self._outlet.put(data, attachment=self.attachment())


def _outlet(node: ZenohNode, end: Entity) -> Outlet:
    drop = node.zenoh.CongestionControl.DROP
    # Count only remote subscribers, because the bridge's own subscription ignores messages from this session.
    remote = node.zenoh.Locality.REMOTE
    if not end.qos.is_transient_local:
        return node.session.declare_publisher(end.key, congestion_control=drop, allowed_destination=remote)
    extension = importlib.import_module("zenoh.ext")
    outlet: Outlet = extension.declare_advanced_publisher(
        node.session,
        end.key,
        congestion_control=drop,
        allowed_destination=remote,
        cache=extension.CacheConfig(max_samples=end.qos.depth),
        sample_miss_detection=extension.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=1.0),
        publisher_detection=True,
    )
    return outlet


def subscribe(node: ZenohNode, end: Entity, deliver: Callable[[bytes], None]) -> Handle:
    """Call ``deliver`` for each serialized message on a topic, in one of Zenoh's threads, until the handle is closed."""

    def arrived(sample: Sample) -> None:
        if sample.kind != node.zenoh.SampleKind.PUT:
            return
        try:
            deliver(sample.payload.to_bytes())
        except Exception:  # noqa: BLE001 - otherwise Zenoh would print the error, or end its thread
            _log.exception("a message of ROS 2 could not be passed on")

    handler = node.handler(arrived)
    # Ignore messages that the bridge itself publishes.
    remote = node.zenoh.Locality.REMOTE
    if not end.qos.is_transient_local:
        declared = node.session.declare_subscriber(end.key, handler, allowed_origin=remote)
        return Handle(node, end, declared)
    extension = importlib.import_module("zenoh.ext")
    recovery = (
        extension.RecoveryConfig(periodic_queries=None, heartbeat=True) if end.qos.is_reliable else None
    )
    kept: Declared = extension.declare_advanced_subscriber(
        node.session,
        end.key,
        handler,
        allowed_origin=remote,
        history=extension.HistoryConfig(detect_late_publishers=True, max_samples=end.qos.depth),
        recovery=recovery,
        subscriber_detection=True,
    )
    return Handle(node, end, kept)
