"""Selects the services to bridge, and their settings, from snapshots of both graphs. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from minirospy.ros2.links import Direction, is_bridge

__all__ = ["ServiceLink", "is_bridged_type", "service_links"]

_OF_EVERY_NODE = {"roscpp/GetLoggers", "roscpp/SetLoggerLevel"}
_PACKAGES_OF_EVERY_NODE = {"rcl_interfaces", "type_description_interfaces"}
"""Packages with services that every ROS 2 node provides for ROS 2's tools; they are not offered in ROS 1."""


@dataclass(frozen=True)
class ServiceLink:
    """A service with a server on one side, to be offered on the other. Requests are sent in ``direction``."""

    service: str
    direction: Direction
    ros1_type: str
    ros2_type: str

    @property
    def title(self) -> str:
        """Return the link's name for log messages."""
        return f"service {self.service}"


def is_bridged_type(type_: str) -> bool:
    """Return whether to bridge services of a type (``pkg/Name``, on either side): services for ROS 2's tools are excluded."""
    return type_ not in _OF_EVERY_NODE and type_.partition("/")[0] not in _PACKAGES_OF_EVERY_NODE


def is_hidden(name: str) -> bool:
    """Return whether a ROS 2 name is hidden: some part starts with an underscore, as in an action's services."""
    return "/_" in name


def service_links(
    ros1: Mapping[str, tuple[str, ...]],
    ros1_types: Mapping[str, str],
    ros2: Mapping[str, str],
    partner: Callable[[str, Direction], str],
) -> list[ServiceLink]:
    """Return the services to bridge: those with a server on only one side, not counting servers of bridges.

    ``ros1`` maps services to their nodes, ``ros1_types`` to their types if known. ``ros2`` maps services to their types.
    ``partner(type, direction)`` returns the type on the calling side.
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
