"""roslaunch.scriptapi: starts nodes one by one from a program."""

from __future__ import annotations

from minirospy.ros.roslaunch.roslaunch.config import ROSLaunchConfig
from minirospy.ros.roslaunch.roslaunch.core import Master, Node, RLException
from minirospy.ros.roslaunch.roslaunch.parent import ROSLaunchParent
from minirospy.ros.roslaunch.roslaunch.pmon import Process
from minirospy.ros.roslaunch.roslaunch.rlutil import get_or_generate_uuid
from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlLoader

__all__ = ["Master", "Node", "RLException", "ROSLaunch"]


class ROSLaunch:
    """Starts nodes one by one: ``start()``, ``launch(Node(...))``, ``stop()``. Methods raise RLException on an error."""

    def __init__(self) -> None:
        self.parent = ROSLaunchParent(get_or_generate_uuid(None, True), [])
        self.started = False

    def load(self, f: str) -> None:
        """Add a launch file for start() to run."""
        XmlLoader().load(f, self._config)

    def load_str(self, s: str) -> None:
        """Add a launch file, given as a string, for start() to run."""
        XmlLoader().load_string(s, self._config)

    def start(self) -> None:
        """Start the launch, so that launch() can start nodes."""
        self.parent.start(auto_terminate=False)
        self.started = True

    def launch(self, node: Node) -> Process:
        """Start a node."""
        if not self.started or self.parent.runner is None:
            raise RLException("please start ROSLaunch first")
        if not isinstance(node, Node):
            raise ValueError("arg must be of type Node")
        process, _ = self.parent.runner.launch_node(node)
        if isinstance(process, str):
            raise RLException(f"failed to launch {node.package}/{node.type}")
        return process

    def spin(self) -> None:
        """Wait until the run is over."""
        self.parent.spin()

    def spin_once(self) -> bool:
        """Return whether the run continues."""
        return self.parent.spin_once()

    def stop(self) -> None:
        """Terminate all processes."""
        self.parent.shutdown()

    @property
    def _config(self) -> ROSLaunchConfig:
        if self.parent.config is None:
            self.parent.config = ROSLaunchConfig()
        return self.parent.config
