"""rosgraph, filled in by minirospy: the master as Python code asks it, names, the environment."""

import sys
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType

from minirospy.names import parse_arguments

__all__ = ["myargv"]


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """The command line without remappings and private parameters, as `rospy.myargv` gives it."""
    return parse_arguments(sys.argv if argv is None else argv).plain


def __getattr__(name: str) -> ModuleType:
    # With ROS these two are there wherever rospy is imported, too.
    if name in ("roslogging", "xmlrpc"):
        return import_module(f"rosgraph.{name}")
    raise AttributeError(f"module 'rosgraph' has no attribute '{name}'")
