"""The ROS 2 backend over Zenoh, for nodes that use rmw_zenoh. It requires no ROS 2 on this machine.

Callbacks run in Zenoh's threads. Definitions are derived from ROS 1 definitions and the rules; a type is not bridged if
its hash differs from the one in the other side's keys.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import TYPE_CHECKING

from minirospy.ros2.definitions import NO_HASH, Definitions
from minirospy.ros2.interface import (
    Accept,
    Ros2ActionClient,
    Ros2Client,
    Ros2Handle,
    Ros2Parameters,
    Ros2Publisher,
)
from minirospy.ros2.layouts import TypesDiffer
from minirospy.ros2.links import Ros2End, Ros2Topic, is_bridge
from minirospy.ros2.zenoh_actions import ActionEnds, ActionType, ZenohActionClient, ZenohActionServer
from minirospy.ros2.zenoh_calls import ZenohClient, ZenohServer
from minirospy.ros2.zenoh_keys import Entity, Kind, Qos
from minirospy.ros2.zenoh_node import ZenohNode
from minirospy.ros2.zenoh_parameters import ZenohNodeParameters, ZenohParameterServer
from minirospy.ros2.zenoh_topics import ZenohPublisher, subscribe
from minirospy.zenoh.library import NetworkOptions

if TYPE_CHECKING:
    from minirospy.ros2.rclpy_parameters import ParameterStore

__all__ = ["ZenohSide"]

_TOPIC = (Kind.PUBLISHER, Kind.SUBSCRIPTION)
_SERVICE = (Kind.SERVICE, Kind.CLIENT)
_LATCHED = Qos(True, True, 1)


class ZenohSide:
    """The Zenoh backend: one session, with one node."""

    def __init__(self, name: str, options: NetworkOptions, definitions: Definitions) -> None:
        """Open the session, and wait for the router. Raise BridgeError if that fails."""
        self._name = name
        self._node = ZenohNode(name, options)
        self._graph = self._node.graph
        self._definitions = definitions

    @property
    def domain(self) -> str:
        """Return the ROS 2 domain's number."""
        return self._node.domain

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        """Return the names of all topics, with their types."""
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
        """Return the (name, namespace) of all nodes except bridges."""
        return [(each.node, each.namespace) for each in self._graph.nodes() if not is_bridge(each.node)]

    def fields(self, type_: str) -> dict[str, str]:
        """Return the fields of a message type.

        Raise TypesDiffer if the type is unknown, or the other side has a different definition of it.
        """
        hash_ = self._agreed(type_, self._definitions.hash(type_), _TOPIC)
        return dict(self._definitions.message(type_, is_humble=hash_ == NO_HASH))

    def publisher(self, topic: str, type_: str, *, depth: int, is_latched: bool) -> Ros2Publisher:
        """Return a publisher. Raise TypesDiffer, like :meth:`fields`."""
        end = self._topic_end(Kind.PUBLISHER, topic, type_, Qos(True, is_latched, depth))
        return ZenohPublisher(self._node, end)

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
        """Subscribe to a topic; call ``deliver`` for each serialized message, in one of Zenoh's threads.

        Raise TypesDiffer like :meth:`fields`.
        """
        end = self._topic_end(Kind.SUBSCRIPTION, topic, type_, Qos(is_reliable, is_latched, depth))
        return subscribe(self._node, end, deliver)

    def services(self) -> Mapping[str, str]:
        """Return the services of all nodes except bridges, as a dict from name to type."""
        ends = self._graph.ends(Kind.SERVICE)
        return {end.name: end.short_type for end in ends if not is_bridge(end.node)}

    def service_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str]]:
        """Return the fields of a service's request and response. Raise TypesDiffer like :meth:`fields`."""
        self._service_end(Kind.CLIENT, "", type_.replace("/", "/srv/"))
        request, response = self._definitions.service(type_)
        return dict(request), dict(response)

    def client(self, service: str, type_: str) -> Ros2Client:
        """Return a client for a service. Raise TypesDiffer, like :meth:`fields`."""
        return ZenohClient(self._node, self._service_end(Kind.CLIENT, service, type_.replace("/", "/srv/")))

    def serve(self, service: str, type_: str, answer: Callable[[bytes], Future[bytes]]) -> Ros2Handle:
        """Offer a service. Raise TypesDiffer like :meth:`fields`."""
        response = self._definitions.service(type_)[1]
        end = self._service_end(Kind.SERVICE, service, type_.replace("/", "/srv/"))
        return ZenohServer(self._node, end, response, answer)

    def action_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
        """Return the fields of an action's goal, result and feedback. Raise TypesDiffer like :meth:`fields`."""
        whole = type_.replace("/", "/action/")
        self._service_end(Kind.CLIENT, "", f"{whole}_SendGoal")
        self._service_end(Kind.CLIENT, "", f"{whole}_GetResult")
        feedback = f"{whole}_FeedbackMessage"
        self._agreed(feedback, self._definitions.hash(feedback), _TOPIC)
        goal, result, feedback_fields = self._definitions.action(type_)
        return dict(goal), dict(result), dict(feedback_fields)

    def action_client(self, action: str, type_: str) -> Ros2ActionClient:
        """Return a client for an action. Raise TypesDiffer, like :meth:`fields`."""
        ends = self._action_ends(action, type_, Kind.CLIENT, Kind.SUBSCRIPTION)
        return ZenohActionClient(self._node, ends, self._action_type(type_))

    def action_server(self, action: str, type_: str, accept: Accept) -> Ros2Handle:
        """Offer an action. Raise TypesDiffer like :meth:`fields`."""
        ends = self._action_ends(action, type_, Kind.SERVICE, Kind.PUBLISHER)
        return ZenohActionServer(self._node, ends, self._action_type(type_), accept)

    def serve_parameters(self, store: ParameterStore, loop: asyncio.AbstractEventLoop) -> Ros2Handle:
        """Offer the ROS 1 parameters as parameters of this node."""
        return ZenohParameterServer(self, self._name, self._definitions.fields, store, loop)

    def node_parameters(self) -> Ros2Parameters:
        """Return an object that accesses the parameters of other nodes."""
        return ZenohNodeParameters(self, self._definitions.fields)

    def close(self) -> None:
        """Close the session and all its declarations. Idempotent."""
        self._node.close()

    def _topic_end(self, kind: Kind, topic: str, type_: str, qos: Qos) -> Entity:
        hash_ = self._agreed(type_, self._definitions.hash(type_), _TOPIC, topic)
        return self._node.entity(kind, topic, type_, hash_, qos)

    def _service_end(self, kind: Kind, name: str, type_: str) -> Entity:
        """Return an endpoint of a service with the type ``pkg/srv/Name`` or ``pkg/action/Name_SendGoal``."""
        hash_ = self._agreed(type_, self._definitions.hash(type_), _SERVICE, name)
        return self._node.entity(kind, name, type_, hash_, Qos())

    def _action_ends(self, action: str, type_: str, service: Kind, topic: Kind) -> ActionEnds:
        whole = type_.replace("/", "/action/")
        space = f"{action}/_action"
        return ActionEnds(
            self._service_end(service, f"{space}/send_goal", f"{whole}_SendGoal"),
            self._service_end(service, f"{space}/get_result", f"{whole}_GetResult"),
            self._service_end(service, f"{space}/cancel_goal", "action_msgs/srv/CancelGoal"),
            self._topic_end(topic, f"{space}/feedback", f"{whole}_FeedbackMessage", Qos()),
            self._topic_end(topic, f"{space}/status", "action_msgs/GoalStatusArray", _LATCHED),
        )

    def _action_type(self, type_: str) -> ActionType:
        return ActionType(type_.replace("/", "/action/"), self._definitions.fields)

    def _agreed(self, type_: str, own: str, kinds: tuple[Kind, ...], name: str = "") -> str:
        """Return the hash to use for a type in keys: the local one, or NO_HASH if the other side uses no hashes.

        Raise TypesDiffer if the other side's endpoints have a different hash.
        """
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
        # No endpoint uses this type, so use NO_HASH only if all other endpoints do.
        are_humble = [end.hash == NO_HASH for end in self._graph.ends(*_TOPIC, *_SERVICE)]
        return NO_HASH if are_humble and all(are_humble) else own


def _end(entity: Entity) -> Ros2End:
    return Ros2End(entity.node, entity.short_type, entity.qos.is_reliable, entity.qos.is_transient_local)
