"""roslaunch.node_args: nodes and their command lines."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.launcher.command import node_command, node_environment
from minirospy.ros.roslaunch.launcher.spec import NodeSpec
from minirospy.ros.roslaunch.roslaunch.config import LaunchFile, ROSLaunchConfig
from minirospy.ros.roslaunch.roslaunch.config import load_config_default as load_config_default
from minirospy.ros.roslaunch.roslaunch.core import Machine, Node
from minirospy.ros.roslaunch.roslaunch.substitution_args import chosen_packages

__all__ = [
    "NodeParamsException",
    "create_local_process_args",
    "get_node_args",
    "get_node_list",
    "print_node_args",
    "print_node_filename",
    "print_node_list",
]


def get_node_list(config: ROSLaunchConfig) -> list[str]:
    """Return the nodes' names, sorted."""
    return sorted(config.resolved_node_names)


def get_node_args(node_name: str, roslaunch_files: Sequence[LaunchFile]) -> list[str]:
    """Return a node's command, preceded by its environment variables.

    Raise NodeParamsException if the node is unknown or its command cannot be built.
    """
    spec = _find(node_name, roslaunch_files).spec
    environment = node_environment(spec, Environment.read(), {})
    environment.pop("ROS_MASTER_URI")
    return [*(f'{name}="{value}"' for name, value in environment.items()), *_command(spec)]


def create_local_process_args(node: Node, machine: Machine | None, env: object = None) -> list[str]:
    """Return a node's command. Raise NodeParamsException if it cannot be built."""
    node.give_name()
    return _command(node.spec)


def print_node_list(roslaunch_files: Sequence[LaunchFile]) -> None:
    """Print the nodes' names."""
    print("\n".join(load_config_default(roslaunch_files, None).resolved_node_names))


def print_node_args(node_name: str, roslaunch_files: Sequence[LaunchFile]) -> None:
    """Print a node's command."""
    print(" ".join(get_node_args(node_name, roslaunch_files)))


def print_node_filename(node_name: str, roslaunch_files: Sequence[LaunchFile]) -> None:
    """Print the launch file that declares a node."""
    print(_find(node_name, roslaunch_files).filename)


def _command(spec: NodeSpec) -> list[str]:
    try:
        return node_command(spec, chosen_packages())
    except MinirospyError as error:
        raise NodeParamsException(str(error)) from error


def _find(name: str, files: Sequence[LaunchFile]) -> Node:
    config = load_config_default(files, None)
    names = [f"{node.namespace}{node.name}" for node in config.nodes]
    if "/" + name.strip("/") not in names:
        raise NodeParamsException(f"Cannot find node named [{name}]: there are {', '.join(names) or 'none'}")
    return config.nodes[names.index("/" + name.strip("/"))]


class NodeParamsException(Exception):
    """Raised if a node's command cannot be built."""
