"""roslaunch.arg_dump: the arguments of launch files."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.base import names
from minirospy.ros.roslaunch.launcher.arg_docs import resolved_arg_docs
from minirospy.ros.roslaunch.roslaunch.config import LaunchFile
from minirospy.ros.roslaunch.roslaunch.substitution_args import chosen_packages

__all__ = ["get_args"]


def get_args(roslaunch_files: Sequence[LaunchFile]) -> dict[str, tuple[str | None, str | None]]:
    """Return the args that launch files declare, as a dict from name to (doc, default)."""
    packages, found = chosen_packages(), {}
    for each in roslaunch_files:
        file, argv = (each, []) if isinstance(each, str) else each
        for arg in resolved_arg_docs(file, names.parse_launch_arguments(argv), packages):
            found[arg.name] = (arg.doc, arg.default)
    return found
