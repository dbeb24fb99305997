"""What a launch file says, when all substitutions are done."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

__all__ = ["ArgDoc", "LaunchSpec", "NodeSpec"]


@dataclass(frozen=True)
class NodeSpec:
    """A ``<node>``. ``name`` is global; ``remaps`` and ``env`` hold those of the groups around it too."""

    name: str
    package: str
    type: str
    args: str = ""
    output: str = "log"
    respawn: bool = False
    respawn_delay: float = 0.0
    required: bool = False
    cwd: str = "ROS_HOME"
    launch_prefix: str = ""
    remaps: tuple[tuple[str, str], ...] = ()
    env: tuple[tuple[str, str], ...] = ()
    file: str = ""
    line: int = 0

    @property
    def base_name(self) -> str:
        """The name without its namespace."""
        return self.name.rpartition("/")[2]

    @property
    def namespace(self) -> str:
        """The namespace, with a slash at its end."""
        return self.name.rpartition("/")[0] + "/"


@dataclass(frozen=True)
class ArgDoc:
    """An ``<arg>`` of the first file: its default (None where it is required), and its doc."""

    name: str
    default: str | None
    doc: str | None


@dataclass
class LaunchSpec:
    """Everything that the files say together. ``params`` has leaves only; ``clear`` names namespaces to delete."""

    nodes: list[NodeSpec] = field(default_factory=list)
    params: dict[str, Any] = field(default_factory=dict)
    clear: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    args: dict[str, ArgDoc] = field(default_factory=dict)
