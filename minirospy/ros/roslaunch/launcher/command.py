"""A node's command, environment and working folder. Source: http://wiki.ros.org/roslaunch/XML/node."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from pathlib import Path

from minirospy.base.environment import DEFAULT_MASTER_PORT, Environment, export_local
from minirospy.base.errors import LaunchError, MinirospyError, NotFoundError
from minirospy.ros.roslaunch.launcher.spec import NodeSpec
from minirospy.workspace.packages import NotExecutableError, Packages, with_prefix

__all__ = ["node_command", "node_environment", "node_folder", "node_program", "shell_line"]


def node_program(node: NodeSpec, packages: Packages) -> list[str]:
    """Return the command that runs a node's program, without node arguments; the program's path is last.

    Raise MinirospyError if the package or the program is not found, or if the program is not executable.
    """
    try:
        return packages.find_executable(node.package, node.type)
    except (NotFoundError, NotExecutableError) as error:
        raise _fault(node, str(error)) from error


def node_command(node: NodeSpec, packages: Packages) -> list[str]:
    """Return the command that runs a node, with its name and remappings.

    Raise MinirospyError like node_program, or if ``args`` or ``launch-prefix`` cannot be split.
    """
    program = node_program(node, packages)
    try:
        prefix, args = shlex.split(node.launch_prefix), shlex.split(node.args)
    except ValueError as error:
        raise _fault(node, f"args or launch-prefix: {error}") from None
    remaps = [f"{a}:={b}" for a, b in node.remaps]
    return [*with_prefix(prefix, program), *args, *remaps, f"__name:={node.base_name}"]


def node_environment(
    node: NodeSpec, environment: Environment, environ: Mapping[str, str] | None = None
) -> dict[str, str]:
    """Return the environment variables for a node's process."""
    variables = {**(os.environ if environ is None else environ), **dict(node.env)}
    variables["ROS_MASTER_URI"] = environment.master_uri
    export_local(variables)
    namespace = node.namespace.rstrip("/")
    if namespace:
        variables["ROS_NAMESPACE"] = namespace
    else:
        variables.pop("ROS_NAMESPACE", None)
    return variables


def node_folder(node: NodeSpec, packages: Packages, environment: Environment) -> Path:
    """Return a node's working folder. Raise MinirospyError if cwd is "node" and the program is not found."""
    return Path(node_program(node, packages)[-1]).parent if node.cwd == "node" else environment.home


def shell_line(node: NodeSpec, packages: Packages) -> str:
    """Format a node's command like `roslaunch --args`, with its environment variables.

    Raise MinirospyError like node_command.
    """
    namespace = node.namespace.rstrip("/")
    variables = [("ROS_NAMESPACE", namespace)] if namespace else []
    if not os.environ.get("ROS_MASTER_URI"):
        variables.insert(0, ("ROS_MASTER_URI", f"http://localhost:{DEFAULT_MASTER_PORT}/"))
    words = [f'{name}="{value}"' for name, value in (*variables, *node.env)]
    return " ".join([*words, *node_command(node, packages)])


def _fault(node: NodeSpec, text: str) -> MinirospyError:
    """Return an error about a node, with the file and line if a launch file declares the node."""
    message = f"node [{node.base_name}]: {text}"
    return LaunchError(node.file, node.line, message) if node.file else MinirospyError(message)
