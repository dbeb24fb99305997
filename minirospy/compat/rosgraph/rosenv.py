"""The environment's settings, under rosgraph's names."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from minirospy.environment import DEFAULT_MASTER_PORT
from minirospy.names import parse_arguments

__all__ = [
    "DEFAULT_MASTER_URI",
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "get_master_uri",
]

ROS_MASTER_URI = "ROS_MASTER_URI"
ROS_IP = "ROS_IP"
ROS_IPV6 = "ROS_IPV6"
ROS_HOSTNAME = "ROS_HOSTNAME"
ROS_NAMESPACE = "ROS_NAMESPACE"
DEFAULT_MASTER_URI = f"http://localhost:{DEFAULT_MASTER_PORT}/"


def get_master_uri(env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None) -> str:
    """Return the URI of the master that the command line (``__master:=``) or else the environment names."""
    named = parse_arguments(sys.argv if argv is None else argv).special.get("__master")
    return named or (os.environ if env is None else env).get(ROS_MASTER_URI) or DEFAULT_MASTER_URI
