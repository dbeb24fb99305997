"""rosgraph: the Master API, names and the environment for Python code."""

import sys
from collections.abc import Sequence

from minirospy.base.names import parse_arguments
from minirospy.ros.submodules import on_first_use

__all__ = ["myargv"]

__getattr__ = on_first_use("rosgraph", "roslogging", "xmlrpc")


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return the command line without remappings and private parameters, like `rospy.myargv`."""
    return parse_arguments(sys.argv if argv is None else argv).plain
