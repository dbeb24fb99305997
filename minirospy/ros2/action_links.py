"""Selects the actions to bridge from snapshots of both graphs. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from minirospy.introspect.snapshot import Snapshot
from minirospy.ros2.links import Direction, is_bridge

__all__ = ["ActionLink", "action_links", "send_goal_service"]

_SEND_GOAL = "/_action/send_goal"
_GOAL_TYPE = "ActionGoal"


@dataclass(frozen=True)
class ActionLink:
    """An action with a server on one side, to be offered on the other. Goals are sent in ``direction``."""

    action: str
    direction: Direction
    ros1_type: str
    ros2_type: str

    @property
    def title(self) -> str:
        """Return the link's name for log messages."""
        return f"action {self.action}"


def send_goal_service(action: str) -> str:
    """Return the name of the service on which a ROS 2 action receives goals."""
    return action + _SEND_GOAL


def action_links(
    ros1: Snapshot, ros2_services: Mapping[str, str], partner: Callable[[str, Direction], str]
) -> list[ActionLink]:
    """Return the actions to bridge: those with a server on only one side, not counting servers of bridges.

    ``ros2_services`` maps services to their types. ``partner(type, direction)`` returns the type on the side that sends goals.
    """
    here = dict(_of_ros1(ros1))
    there = {
        service.removesuffix(_SEND_GOAL): type_.removesuffix("_SendGoal")
        for service, type_ in ros2_services.items()
        if service.endswith(_SEND_GOAL) and type_.endswith("_SendGoal")
    }
    found = [
        ActionLink(name, Direction.TO_ROS1, here[name], partner(here[name], Direction.TO_ROS1))
        for name in here.keys() - there.keys()
    ]
    found += [
        ActionLink(name, Direction.TO_ROS2, partner(there[name], Direction.TO_ROS2), there[name])
        for name in there.keys() - here.keys()
    ]
    return sorted(found, key=lambda link: link.action)


def _of_ros1(ros1: Snapshot) -> list[tuple[str, str]]:
    found = []
    for topic, type_ in ros1.types.items():
        if not topic.endswith("/goal") or not type_.endswith(_GOAL_TYPE):
            continue
        name = topic.removesuffix("/goal")
        # A server subscribes to goals and publishes results.
        servers = set(ros1.subscribers.get(topic, ())) & set(ros1.publishers.get(f"{name}/result", ()))
        if not all(map(is_bridge, servers)):
            found.append((name, type_.removesuffix(_GOAL_TYPE)))
    return found
