"""rosgraph, filled in by minirospy: the master as Python code asks it, names, the environment."""

import sys
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType

from minirospy.names import parse_arguments
from rosgraph import masterapi as masterapi
from rosgraph import names as names
from rosgraph import network as network
from rosgraph import rosenv as rosenv
from rosgraph.masterapi import Master, MasterError, MasterException, MasterFailure
from rosgraph.masterapi import is_online as is_master_online
from rosgraph.rosenv import ROS_HOSTNAME, ROS_IP, ROS_IPV6, ROS_MASTER_URI, ROS_NAMESPACE, get_master_uri

__all__ = [
    "ROS_HOSTNAME", "ROS_IP", "ROS_IPV6", "ROS_MASTER_URI", "ROS_NAMESPACE", "Master", "MasterError", "MasterException",
    "MasterFailure", "get_master_uri", "is_master_online", "myargv",
]  # fmt: skip


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """The command line without remappings and private parameters, as `rospy.myargv` gives it."""
    return parse_arguments(sys.argv if argv is None else argv).plain


def __getattr__(name: str) -> ModuleType:
    # With ROS these two are there wherever rospy is imported, too.
    if name in ("roslogging", "xmlrpc"):
        return import_module(f"rosgraph.{name}")
    raise AttributeError(f"module 'rosgraph' has no attribute '{name}'")
