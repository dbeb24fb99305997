"""Which services are bridged, and how: from what both graphs offer at a moment. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from minirospy.ros2.links import Direction, is_bridge

__all__ = ["ServiceLink", "is_bridged_type", "service_links"]

_OF_EVERY_NODE = {"roscpp/GetLoggers", "roscpp/SetLoggerLevel"}
_PACKAGES_OF_EVERY_NODE = {"rcl_interfaces", "type_description_interfaces"}
"""Services that nodes of one side have for that side's tools: they are not offered to the other one."""


@dataclass(frozen=True)
class ServiceLink:
    """A service that is offered on one side and called from the other. ``direction``: where requests go."""

    service: str
    direction: Direction
    ros1_type: str
    ros2_type: str

    @property
    def title(self) -> str:
        """How messages to people name the link."""
        return f"service {self.service}"


def is_bridged_type(type_: str) -> bool:
    """Return whether services of a type, ``pkg/Name`` of either side, are meant for other nodes."""
    return type_ not in _OF_EVERY_NODE and type_.partition("/")[0] not in _PACKAGES_OF_EVERY_NODE


def is_hidden(name: str) -> bool:
    """Return whether a name is hidden in ROS 2, as those of actions are: a part of it starts with an underscore."""
    return "/_" in name


def service_links(
    ros1: Mapping[str, tuple[str, ...]],
    ros1_types: Mapping[str, str],
    ros2: Mapping[str, str],
    partner: Callable[[str, Direction], str],
) -> list[ServiceLink]:
    """Return what is to be bridged: each service that one side alone offers, bridges not counted.

    ``ros1``: services and their nodes; ``ros1_types``: those whose type is known. ``ros2``: services and their types.
    ``partner(type, direction)``: the type of the side that calls.
    """
    offered = {name for name, nodes in ros1.items() if not all(map(is_bridge, nodes))}
    found = []
    for name in sorted(offered - ros2.keys()):
        type_ = ros1_types.get(name)
        if type_ is not None and is_bridged_type(type_):
            found.append(ServiceLink(name, Direction.TO_ROS1, type_, partner(type_, Direction.TO_ROS1)))
    for name in sorted(ros2.keys() - offered):
        type_ = ros2[name]
        if is_bridged_type(type_) and not is_hidden(name):
            found.append(ServiceLink(name, Direction.TO_ROS2, partner(type_, Direction.TO_ROS2), type_))
    return sorted(found, key=lambda link: link.service)
