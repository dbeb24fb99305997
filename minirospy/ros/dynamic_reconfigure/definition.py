"""Configurations that a module defines without a .cfg file, and a function that closes a server."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import GroupTree, Value
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.parameter_generator_catkin import (
    ParameterGenerator,
)
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.server import Server

__all__ = ["Definition", "close_server"]


class Definition(ParameterGenerator):
    """Defines parameters without a .cfg file: call ``add`` as in such a file. A server reads it like a generated module."""

    def __init__(self) -> None:
        """Start with no parameters. Unlike in a .cfg file, no output folders are needed."""
        self.group = self.Group(self, "Default", "", True, 0, 0)
        self.constants = []

    @property
    def config_description(self) -> GroupTree:
        """The tree of groups with their parameters."""
        return self.group.to_dict()

    @property
    def defaults(self) -> Mapping[str, Value]:
        """The parameters' default values."""
        return self._values("default")

    @property
    def min(self) -> Mapping[str, Value]:
        """The parameters' minimum values."""
        return self._values("min")

    @property
    def max(self) -> Mapping[str, Value]:
        """The parameters' maximum values."""
        return self._values("max")

    @property
    def level(self) -> Mapping[str, int]:
        """Return the bits passed to the server's callback when each parameter changes."""
        return self._values("level")

    @property
    def type(self) -> Mapping[str, str]:
        """The parameters' types."""
        return self._values("type")

    def _values(self, key: Literal["default", "min", "max", "level", "type"]) -> dict[str, Any]:
        return {each["name"]: each[key] for each in self.group.get_parameters()}


def close_server(server: Server) -> None:
    """Close a server's service and topics. In ROS, they stay open until the node shuts down."""
    server.set_service.shutdown()
    server.descr_topic.unregister()
    server.update_topic.unregister()
