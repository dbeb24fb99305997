"""Settings from the environment, as in ROS's rosgraph.rosenv."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from minirospy.base.environment import DEFAULT_MASTER_PORT

__all__ = [
    "DEFAULT_MASTER_PORT",
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
    """Return the master URI from the command line's first ``__master:=``, or from the environment.

    Raise ValueError if the argument is empty or contains another ``:=``.
    """
    for argument in sys.argv if argv is None else argv:
        if argument.startswith("__master:="):
            uri = argument.removeprefix("__master:=")
            if not uri or ":=" in uri:
                raise ValueError(f"__master remapping argument '{argument}' improperly specified")
            return uri
    return (os.environ if env is None else env).get(ROS_MASTER_URI) or DEFAULT_MASTER_URI
