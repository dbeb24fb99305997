"""Opens and closes actions between the two sides, and converts their messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.ros2.action_codecs import ActionCodec, ActionCodecs
from minirospy.ros2.action_links import ActionLink, action_links
from minirospy.ros2.action_to_ros1 import GoalsToRos1
from minirospy.ros2.action_to_ros2 import GoalsToRos2
from minirospy.ros2.link_table import LinkTable, Pair, pairs
from minirospy.ros2.links import Direction
from minirospy.ros2.rules import Rules

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.base.name_filter import NameFilter
    from minirospy.core.idl.load import Catalogue
    from minirospy.introspect.snapshot import Snapshot
    from minirospy.ros2.interface import Ros2Side

__all__ = ["ActionBridge"]


class ActionBridge:
    """Makes each side's actions available on the other side. Runs on the node's loop."""

    def __init__(
        self, node: Node, side: Ros2Side, actions: NameFilter, rules: Rules, catalogue: Catalogue
    ) -> None:
        self._node = node
        self._side = side
        self._actions = actions
        self._types = ActionCodecs(side, rules, catalogue)
        self._table: LinkTable[ActionLink, GoalsToRos1 | GoalsToRos2] = LinkTable(node.log, self._make)

    async def close(self) -> None:
        """Close all actions. Idempotent."""
        await self._table.close()

    def pairs(self, snapshot: Snapshot) -> list[Pair]:
        """Return the actions that should be bridged, each with the reason if that is impossible."""
        return pairs(self._wanted(snapshot), self._codec)

    async def look(self, snapshot: Snapshot) -> bool:
        """Open and close actions to match both graphs. Return whether any action was opened or closed."""
        return await self._table.update(self._wanted(snapshot))

    def _wanted(self, snapshot: Snapshot) -> list[ActionLink]:
        found = action_links(snapshot, self._side.services(), self._types.partner)
        return [link for link in found if self._actions(link.action)]

    def _codec(self, link: ActionLink) -> ActionCodec:
        return self._types.codec(link.ros1_type, link.ros2_type)

    def _make(self, link: ActionLink) -> GoalsToRos1 | GoalsToRos2:
        made = GoalsToRos2 if link.direction is Direction.TO_ROS2 else GoalsToRos1
        return made(self._node, self._side, link, self._codec(link))
