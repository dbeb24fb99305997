"""The whole dashboard: a bridge on one port that also serves the page and its endpoints."""

from __future__ import annotations

from contextlib import AsyncExitStack
from pathlib import Path

from minirospy.aio.node import Node
from minirospy.web.bridge import Bridge, BridgeOptions, Extras
from minirospy.web.dashboard.bag_endpoint import BagEndpoint
from minirospy.web.dashboard.bag_folder import BagFolder
from minirospy.web.dashboard.board_endpoint import BoardEndpoint
from minirospy.web.dashboard.codes import Codes
from minirospy.web.dashboard.drive_endpoint import DriveEndpoint
from minirospy.web.dashboard.files import handlers, read_folder
from minirospy.web.dashboard.joint_endpoint import JointEndpoint
from minirospy.web.dashboard.launch_endpoint import LaunchEndpoint
from minirospy.web.dashboard.rviz_endpoint import RvizEndpoint
from minirospy.web.dashboard.tools_endpoint import ToolsEndpoint

__all__ = ["PORT", "Dashboard"]

PORT = 8766


class Dashboard:
    """Serves the dashboard's page. Runs on the node's loop."""

    def __init__(
        self,
        node: Node,
        options: BridgeOptions,
        rviz_file: Path | None = None,
        bags: BagFolder | None = None,
        *,
        publishes_joints: bool = False,
        embeds: bool = False,
        codes: Codes | None = None,
    ) -> None:
        """Create the dashboard.

        ``options.foxglove_port`` is the port of the page and its data; the 3D view opens ``rviz_file``. ``bags``: the
        bags that may be opened, by default all bags in the working folder. ``publishes_joints``: publish joints like
        joint_state_publisher_gui, even if no page is open. ``embeds``: notebooks on this machine may embed the page.
        ``codes``: the one-time codes of a page that was served before this dashboard.
        """
        master_uri = node.master_uri
        self.codes = codes or Codes()
        self._board = BoardEndpoint()
        self.rviz = RvizEndpoint(rviz_file)
        self._tools = ToolsEndpoint(master_uri)
        self.bags = BagEndpoint(bags or BagFolder(Path.cwd()), master_uri, lambda: self.bridge.graph)
        self.launches = LaunchEndpoint(master_uri)
        self._joints = JointEndpoint(node, lambda: self.bridge.graph, always_publishes=publishes_joints)
        driving = DriveEndpoint(lambda: self.bridge.graph)
        own = (self.rviz, self.bags, self.launches, self._joints)
        endpoints = (self._board, self._tools, driving, *own)
        pages = {**handlers(read_folder(), embeds=embeds), "/token": self.codes.serve}
        self.bridge = Bridge(node, options, extras=Extras(endpoints, pages))

    @property
    def port(self) -> int:
        """Return the page's port. It is known after :meth:`start`."""
        return self.bridge.listeners["foxglove"].port

    async def start(self) -> None:
        """Open the ports. Raise BridgeError if one cannot be opened."""
        await self.bridge.start()
        if self._joints.always_publishes:
            self._joints.start_work()

    async def close(self) -> None:
        """Disconnect all clients. Idempotent."""
        self.codes.close()
        async with AsyncExitStack() as closing:
            # Close all parts, in reverse order, even if one fails: players use the bridge until their sessions end.
            for part in (
                self._tools,
                self._board,
                self.bridge,
                self.rviz,
                self.launches,
                self._joints,
                self.bags,
            ):
                closing.push_async_callback(part.close)
