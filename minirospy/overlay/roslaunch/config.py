"""roslaunch.config, provided by minirospy."""

from minirospy.base.environment import DEFAULT_MASTER_PORT
from minirospy.ros.roslaunch.roslaunch.config import (
    ROSLaunchConfig,
    get_roscore_filename,
    load_config_default,
    namespaces_of,
)
from minirospy.ros.roslaunch.roslaunch.core import Master, RLException, is_machine_local, local_machine

__all__ = [
    "DEFAULT_MASTER_PORT",
    "Master",
    "RLException",
    "ROSLaunchConfig",
    "get_roscore_filename",
    "is_machine_local",
    "load_config_default",
    "local_machine",
    "namespaces_of",
]
