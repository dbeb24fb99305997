"""roslaunch.node_args, filled in by minirospy."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.environment import Environment
from minirospy.errors import MinirospyError
from minirospy.launch.command import node_command, node_environment
from minirospy.launch.config import LaunchFile, Node, ROSLaunchConfig, load_config_default
from minirospy.workspace.packages import Packages

__all__ = ["NodeParamsException", "get_node_args", "get_node_list", "print_node_args", "print_node_list"]


class NodeParamsException(Exception):
    """The command of a node cannot be made."""


def get_node_list(config: ROSLaunchConfig) -> list[str]:
    """The names of the nodes, sorted."""
    return sorted(config.resolved_node_names)


def get_node_args(node_name: str, roslaunch_files: Sequence[LaunchFile]) -> list[str]:
    """The command of a node, the variables of its environment in front. Raises NodeParamsException."""
    spec = _find(node_name, roslaunch_files).spec
    environment = node_environment(spec, Environment.read(), {})
    environment.pop("ROS_MASTER_URI")
    try:
        command = node_command(spec, Packages())
    except MinirospyError as error:
        raise NodeParamsException(str(error)) from error
    return [*(f'{name}="{value}"' for name, value in environment.items()), *command]


def print_node_list(roslaunch_files: Sequence[LaunchFile]) -> None:
    """Print the names of the nodes."""
    print("\n".join(load_config_default(roslaunch_files, None).resolved_node_names))


def print_node_args(node_name: str, roslaunch_files: Sequence[LaunchFile]) -> None:
    """Print the command of a node."""
    print(" ".join(get_node_args(node_name, roslaunch_files)))


def _find(name: str, files: Sequence[LaunchFile]) -> Node:
    config = load_config_default(files, None)
    names = [f"{node.namespace}{node.name}" for node in config.nodes]
    if "/" + name.strip("/") not in names:
        raise NodeParamsException(f"Cannot find node named [{name}]: there are {', '.join(names) or 'none'}")
    return config.nodes[names.index("/" + name.strip("/"))]
