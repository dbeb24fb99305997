"""rosgraph: the Master API, names and the environment for Python code."""

import sys
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType

from minirospy.names import parse_arguments

__all__ = ["myargv"]


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return the command line without remappings and private parameters, as `rospy.myargv` gives it."""
    return parse_arguments(sys.argv if argv is None else argv).plain


def __getattr__(name: str) -> ModuleType:
    # With ROS these two are also loaded by `import rospy`.
    if name in ("roslogging", "xmlrpc"):
        return import_module(f"rosgraph.{name}")
    raise AttributeError(f"module 'rosgraph' has no attribute '{name}'")
