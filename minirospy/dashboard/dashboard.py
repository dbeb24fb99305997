"""The dashboard as a whole: a bridge at one port, with the page and the doors of the board, of driving and of tools in it."""

from __future__ import annotations

from pathlib import Path

from minirospy.aio.node import Node
from minirospy.bridge.bridge import Addition, Bridge, BridgeOptions
from minirospy.dashboard.board_door import BoardDoor
from minirospy.dashboard.drive_door import DriveDoor
from minirospy.dashboard.files import handlers, read_folder
from minirospy.dashboard.rviz_door import RvizDoor
from minirospy.dashboard.tools_door import ToolsDoor

__all__ = ["PORT", "Dashboard"]

PORT = 8766


class Dashboard:
    """Serves the page. On the node's loop."""

    def __init__(self, node: Node, options: BridgeOptions, rviz_file: Path | None = None) -> None:
        """``options.foxglove_port`` is the port of the page and of its data; the 3D view opens ``rviz_file``."""
        self._board = BoardDoor()
        self.rviz = RvizDoor(rviz_file)
        self._tools = ToolsDoor()
        doors = (self._board, self._tools, DriveDoor(lambda: self.bridge.graph), self.rviz)
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
        await self.bridge.close()
        await self._board.close()
        await self._tools.close()
