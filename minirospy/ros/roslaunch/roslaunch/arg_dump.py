"""roslaunch.arg_dump: the arguments of launch files."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.base import names
from minirospy.ros.roslaunch.launcher.arg_docs import resolved_arg_docs
from minirospy.ros.roslaunch.roslaunch.config import LaunchFile, RLException
from minirospy.ros.roslaunch.roslaunch.substitution_args import chosen_packages

__all__ = [
    "dump_args",
    "get_args",
]


def get_args(roslaunch_files: Sequence[LaunchFile]) -> dict[str, tuple[str | None, str | None]]:
    """Return the args that launch files declare as a dict from names to (doc, default)."""
    packages, found = chosen_packages(), {}
    for each in roslaunch_files:
        file, argv = (each, []) if isinstance(each, str) else each
        for arg in resolved_arg_docs(file, names.parse_launch_arguments(argv), packages):
            found[arg.name] = (arg.doc, arg.default)
    return found


def dump_args(roslaunch_files: Sequence[LaunchFile]) -> None:
    """Print the launch files' arguments, required ones first. Print an error and exit if a file cannot be read."""
    try:
        args = get_args(roslaunch_files)
    except RLException as error:
        print(error, file=sys.stderr)
        sys.exit(1)
    if not args:
        print("No arguments.")
    required = {name: doc for name, (doc, default) in args.items() if not default}
    optional = {name: both for name, both in args.items() if both[1]}
    if required:
        print("Required Arguments:")
        for name, doc in sorted(required.items()):
            print(f"  {name}: {doc or 'undocumented'}")
    if optional:
        print("Optional Arguments:")
        for name, (doc, default) in sorted(optional.items()):
            print(f'  {name} (default "{default}"): {doc or "undocumented"}')
