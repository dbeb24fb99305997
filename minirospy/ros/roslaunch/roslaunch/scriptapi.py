"""roslaunch.scriptapi: start nodes one by one from a program."""

from __future__ import annotations

from minirospy.ros.roslaunch.roslaunch.config import ROSLaunchConfig
from minirospy.ros.roslaunch.roslaunch.core import Master, Node, RLException
from minirospy.ros.roslaunch.roslaunch.parent import ROSLaunchParent
from minirospy.ros.roslaunch.roslaunch.pmon import Process
from minirospy.ros.roslaunch.roslaunch.rlutil import get_or_generate_uuid
from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlLoader

__all__ = ["Master", "Node", "RLException", "ROSLaunch"]


class ROSLaunch:
    """Starts nodes one by one: ``start()``, ``launch(Node(...))``, ``stop()``. Errors are RLException."""

    def __init__(self) -> None:
        self.parent = ROSLaunchParent(get_or_generate_uuid(None, True), [])
        self.started = False

    def load(self, f: str) -> None:
        """Let start() also run a launch file."""
        XmlLoader().load(f, self._config)

    def load_str(self, s: str) -> None:
        """Let start() also run the text of a launch file."""
        XmlLoader().load_string(s, self._config)

    def start(self) -> None:
        """Start; nodes can now be launched."""
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
        """Wait for the end."""
        self.parent.spin()

    def spin_once(self) -> bool:
        """Return whether it runs on."""
        return self.parent.spin_once()

    def stop(self) -> None:
        """End all."""
        self.parent.shutdown()

    @property
    def _config(self) -> ROSLaunchConfig:
        if self.parent.config is None:
            self.parent.config = ROSLaunchConfig()
        return self.parent.config
