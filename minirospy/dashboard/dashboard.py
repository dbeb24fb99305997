"""The dashboard as a whole: a bridge at one port, with the page and its doors in it."""

from __future__ import annotations

from pathlib import Path

from minirospy.aio.node import Node
from minirospy.bridge.bridge import Addition, Bridge, BridgeOptions
from minirospy.dashboard.bag_door import BagDoor
from minirospy.dashboard.bag_folder import BagFolder
from minirospy.dashboard.board_door import BoardDoor
from minirospy.dashboard.drive_door import DriveDoor
from minirospy.dashboard.files import handlers, read_folder
from minirospy.dashboard.rviz_door import RvizDoor
from minirospy.dashboard.tools_door import ToolsDoor

__all__ = ["PORT", "Dashboard"]

PORT = 8766


class Dashboard:
    """Serves the page. On the node's loop."""

    def __init__(
        self,
        node: Node,
        options: BridgeOptions,
        rviz_file: Path | None = None,
        bags: BagFolder | None = None,
    ) -> None:
        """``options.foxglove_port`` is the port of the page and of its data; the 3D view opens ``rviz_file``.

        ``bags`` are those that may be opened, of the working folder unless given.
        """
        master_uri = node._node.environment.master_uri
        self._board = BoardDoor()
        self.rviz = RvizDoor(rviz_file)
        self._tools = ToolsDoor()
        self._bags = BagDoor(bags or BagFolder(Path.cwd()), master_uri, lambda: self.bridge.graph)
        driving = DriveDoor(lambda: self.bridge.graph)
        doors = (self._board, self._tools, driving, self.rviz, self._bags)
        self.bridge = Bridge(node, options, addition=Addition(doors, handlers(read_folder())))

    @property
    def port(self) -> int:
        """Return the port of the page, once it is served."""
        return self.bridge.listeners["foxglove"].port

    async def start(self) -> None:
        """Listen. Raises BridgeError."""
        await self.bridge.start()

    async def close(self) -> None:
        """Disconnect all clients. Idempotent."""
        # Players publish until their sessions end, and the graph is the bridge's.
        await self._bags.close()
        await self.bridge.close()
        await self._board.close()
        await self._tools.close()
