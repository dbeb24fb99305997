"""The side of ROS 2 by Zenoh, for nodes that run rmw_zenoh: no ROS 2 is installed here.

Zenoh calls back in its own threads. Definitions are those of ROS 1 under the rules; a type whose hash in a key of the other
side differs is not bridged.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import logging
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import TYPE_CHECKING, Protocol, cast

from minirospy.bridge.ros2.definitions import NO_HASH, Definitions
from minirospy.bridge.ros2.interface import (
    Ros2ActionClient,
    Ros2Client,
    Ros2Handle,
    Ros2Parameters,
    Ros2Publisher,
)
from minirospy.bridge.ros2.layouts import TypesDiffer
from minirospy.bridge.ros2.links import Ros2End, Ros2Topic, is_bridge
from minirospy.bridge.ros2.zenoh_calls import ZenohClient, ZenohServer
from minirospy.bridge.ros2.zenoh_keys import Entity, Kind, Qos
from minirospy.bridge.ros2.zenoh_node import Handle, ZenohNode
from minirospy.bridge.zenoh_library import Declared, NetworkOptions, Outlet, Sample
from minirospy.errors import BridgeError

if TYPE_CHECKING:
    from minirospy.bridge.ros2.parameter_values import Value
    from minirospy.bridge.ros2.rclpy_actions import Accept
    from minirospy.bridge.ros2.rclpy_parameters import ParameterStore

__all__ = ["ZenohSide"]

_log = logging.getLogger(__name__)
_TOPIC = (Kind.PUBLISHER, Kind.SUBSCRIPTION)
_SERVICE = (Kind.SERVICE, Kind.CLIENT)
_NO_ACTIONS = "actions are not passed on by --zenoh"
_NO_PARAMETERS = "parameters are not passed on by --zenoh: run the bridge next to an installed ROS 2"


class ZenohSide:
    """ROS 2 by Zenoh: one session with one node."""

    def __init__(self, name: str, options: NetworkOptions, definitions: Definitions) -> None:
        """Open the session; waits for the router. Raises BridgeError."""
        self._node = ZenohNode(name, options)
        self._zenoh = self._node.zenoh
        self._extension = importlib.import_module("zenoh.ext")
        self._graph = self._node.graph
        self._definitions = definitions

    @property
    def domain(self) -> str:
        """The domain of ROS 2."""
        return self._node.domain

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        """Return all topics and their types."""
        found: dict[str, set[str]] = {}
        for end in self._graph.ends(*_TOPIC):
            found.setdefault(end.name, set()).add(end.short_type)
        return {name: tuple(sorted(types)) for name, types in found.items()}

    def ends(self, topic: str) -> Ros2Topic:
        """Return the publishers and subscribers of a topic."""
        return Ros2Topic(
            tuple(map(_end, self._graph.of_name(topic, Kind.PUBLISHER))),
            tuple(map(_end, self._graph.of_name(topic, Kind.SUBSCRIPTION))),
        )

    def nodes(self) -> list[tuple[str, str]]:
        """Return the names and namespaces of all nodes but those of bridges."""
        return [(each.node, each.namespace) for each in self._graph.nodes() if not is_bridge(each.node)]

    def fields(self, type_: str) -> dict[str, str]:
        """Return the fields of a message type. Raise TypesDiffer, also where the other side's is another one."""
        hash_ = self._agreed(type_, self._definitions.hash(type_), _TOPIC)
        return dict(self._definitions.message(type_, is_humble=hash_ == NO_HASH))

    def publisher(self, topic: str, type_: str, *, depth: int, is_latched: bool) -> Ros2Publisher:
        """Return a publisher. Raise TypesDiffer."""
        end = self._topic_end(Kind.PUBLISHER, topic, type_, Qos(True, is_latched, depth))
        drop = self._zenoh.CongestionControl.DROP
        if is_latched:
            outlet: _Outlet = self._extension.declare_advanced_publisher(
                self._node.session,
                end.key,
                congestion_control=drop,
                cache=self._extension.CacheConfig(max_samples=depth),
                sample_miss_detection=self._extension.MissDetectionConfig(
                    heartbeat=None, sporadic_heartbeat=1.0
                ),
                publisher_detection=True,
            )
        else:
            declared = self._node.session.declare_publisher(end.key, congestion_control=drop)
            outlet = cast("_Outlet", declared)
        return _Publisher(self._node, end, outlet)

    def subscribe(
        self,
        topic: str,
        type_: str,
        deliver: Callable[[bytes], None],
        *,
        depth: int,
        is_reliable: bool,
        is_latched: bool,
    ) -> Ros2Handle:
        """Call ``deliver`` with each serialized message, in a thread of Zenoh's. Raise TypesDiffer."""
        end = self._topic_end(Kind.SUBSCRIPTION, topic, type_, Qos(is_reliable, is_latched, depth))

        def arrived(sample: Sample) -> None:
            if sample.kind != self._zenoh.SampleKind.PUT:
                return
            try:
                deliver(sample.payload.to_bytes())
            except Exception:  # noqa: BLE001 - Zenoh would print it, or end its thread
                _log.exception("a message of ROS 2 could not be passed on")

        handler = self._node.handler(arrived)
        remote = self._zenoh.Locality.REMOTE
        if is_latched:
            extension = self._extension
            recovery = (
                extension.RecoveryConfig(periodic_queries=None, heartbeat=True) if is_reliable else None
            )
            declared: Declared = extension.declare_advanced_subscriber(
                self._node.session,
                end.key,
                handler,
                allowed_origin=remote,
                history=extension.HistoryConfig(detect_late_publishers=True, max_samples=depth),
                recovery=recovery,
                subscriber_detection=True,
            )
        else:
            # What this bridge sends does not come back.
            declared = self._node.session.declare_subscriber(end.key, handler, allowed_origin=remote)
        return Handle(self._node, end, declared)

    def services(self) -> Mapping[str, str]:
        """Return the services that others than bridges offer, and their types."""
        ends = self._graph.ends(Kind.SERVICE)
        return {end.name: end.short_type for end in ends if not is_bridge(end.node)}

    def service_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str]]:
        """Return the fields of a service's request and response. Raise TypesDiffer."""
        self._service_end(Kind.CLIENT, "", type_)
        request, response = self._definitions.service(type_)
        return dict(request), dict(response)

    def client(self, service: str, type_: str) -> Ros2Client:
        """Return a client. Raise TypesDiffer."""
        return ZenohClient(self._node, self._service_end(Kind.CLIENT, service, type_))

    def serve(self, service: str, type_: str, answer: Callable[[bytes], Future[bytes]]) -> Ros2Handle:
        """Offer a service. Raise TypesDiffer."""
        response = self._definitions.service(type_)[1]
        return ZenohServer(self._node, self._service_end(Kind.SERVICE, service, type_), response, answer)

    def action_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
        """Raise TypesDiffer."""
        raise TypesDiffer(_NO_ACTIONS)

    def action_client(self, action: str, type_: str) -> Ros2ActionClient:
        """Raise TypesDiffer."""
        raise TypesDiffer(_NO_ACTIONS)

    def action_server(self, action: str, type_: str, accept: Accept) -> Ros2Handle:
        """Raise TypesDiffer."""
        raise TypesDiffer(_NO_ACTIONS)

    def serve_parameters(self, store: ParameterStore, loop: asyncio.AbstractEventLoop) -> Ros2Handle:
        """Return a handle of nothing: parameters are not offered over Zenoh."""
        return _NoParameters()

    def node_parameters(self) -> Ros2Parameters:
        """Return access to parameters that refuses."""
        return _NoParameters()

    def close(self) -> None:
        """End the session, and all that it has declared. Idempotent."""
        self._node.close()

    def _topic_end(self, kind: Kind, topic: str, type_: str, qos: Qos) -> Entity:
        hash_ = self._agreed(type_, self._definitions.hash(type_), _TOPIC, topic)
        return self._node.entity(kind, topic, type_, hash_, qos)

    def _service_end(self, kind: Kind, name: str, type_: str) -> Entity:
        whole = type_.replace("/", "/srv/")
        hash_ = self._agreed(whole, self._definitions.hash(whole), _SERVICE, name)
        return self._node.entity(kind, name, whole, hash_, Qos())

    def _agreed(self, type_: str, own: str, kinds: tuple[Kind, ...], name: str = "") -> str:
        """Return the hash that keys have for a type: one's own where the other side has it too. Raise TypesDiffer."""
        ends = self._graph.of_name(name, *kinds) if name else self._graph.ends(*kinds)
        hashes = {end.hash for end in ends if end.type == type_ and not is_bridge(end.node)}
        if own in hashes:
            return own
        if NO_HASH in hashes:
            return NO_HASH
        if hashes:
            raise TypesDiffer(
                f"[{type_}] has another definition in ROS 2: its hash there is {min(hashes)}, here {own}"
            )
        # No end has it: as most do.
        are_humble = [end.hash == NO_HASH for end in self._graph.ends(*_TOPIC, *_SERVICE)]
        return NO_HASH if are_humble and all(are_humble) else own


class _NoParameters:
    """Parameters, which this side does not have."""

    def close(self) -> None:
        """Do nothing."""

    def names(self, node: str) -> list[str]:
        """Raise BridgeError."""
        raise BridgeError(_NO_PARAMETERS)

    def get(self, node: str, name: str) -> Value:
        """Raise BridgeError."""
        raise BridgeError(_NO_PARAMETERS)

    def set(self, node: str, name: str, value: Value) -> None:
        """Raise BridgeError."""
        raise BridgeError(_NO_PARAMETERS)


class _Matching(Protocol):
    matching: bool


class _Outlet(Outlet, Protocol):
    matching_status: _Matching


class _Publisher(Handle):
    def __init__(self, node: ZenohNode, end: Entity, outlet: _Outlet) -> None:
        super().__init__(node, end, outlet)
        self._graph = node.graph
        self._end = end
        self._outlet = outlet

    @property
    def subscribers(self) -> int:
        """Return the number of subscribers; 0 while those of other sessions are not reached yet."""
        found = self._graph.of_name(self._end.name, Kind.SUBSCRIPTION)
        count = len([each for each in found if each.key == self._end.key])
        # One that keeps its messages loses none.
        is_ready = self._end.qos.is_transient_local or self._outlet.matching_status.matching
        return count if is_ready else 0

    def publish(self, data: bytes) -> None:
        """Send a message; a network that is too slow drops it."""
        # A session that is closed.
        with contextlib.suppress(self._fault):
            self._outlet.put(data, attachment=self.attachment())


def _end(entity: Entity) -> Ros2End:
    return Ros2End(entity.node, entity.short_type, entity.qos.is_reliable, entity.qos.is_transient_local)
