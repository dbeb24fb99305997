"""rosgraph: the Master API, graph names and environment variables, for Python programs."""

import sys as sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.rosgraph.rosgraph import masterapi as masterapi
    from minirospy.ros.rosgraph.rosgraph import names as names
    from minirospy.ros.rosgraph.rosgraph import network as network
    from minirospy.ros.rosgraph.rosgraph import rosenv as rosenv
    from minirospy.ros.rosgraph.rosgraph.masterapi import Master, MasterError, MasterException, MasterFailure
    from minirospy.ros.rosgraph.rosgraph.masterapi import is_online as is_master_online
    from minirospy.ros.rosgraph.rosgraph.rosenv import (
        ROS_HOSTNAME,
        ROS_IP,
        ROS_IPV6,
        ROS_MASTER_URI,
        ROS_NAMESPACE,
        get_master_uri,
    )

__all__ = [
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "Master",
    "MasterError",
    "MasterException",
    "MasterFailure",
    "get_master_uri",
    "is_master_online",
    "myargv",
]


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return the command line without arguments that contain ``:=``.

    Unlike this function, `rospy.myargv` keeps arguments that do not start with a name.
    """
    return [argument for argument in (sys.argv if argv is None else argv) if ":=" not in argument]
