"""roslaunch.config, filled in by minirospy."""

from __future__ import annotations

from minirospy.environment import DEFAULT_MASTER_PORT
from minirospy.launch.config import (
    Master,
    RLException,
    ROSLaunchConfig,
    is_machine_local,
    load_config_default,
    local_machine,
)

__all__ = [
    "DEFAULT_MASTER_PORT",
    "Master",
    "RLException",
    "ROSLaunchConfig",
    "get_roscore_filename",
    "is_machine_local",
    "load_config_default",
    "local_machine",
    "namespaces_of",
]


def get_roscore_filename() -> str | None:
    """The launch file of a master's own nodes: None, the master needs none."""
    return None


def namespaces_of(name: str) -> list[str]:
    """The namespaces that a global name lies in, the root first."""
    parts = name.strip("/").split("/")[:-1]
    return ["/", *("/" + "/".join(parts[: i + 1]) for i in range(len(parts)))]
