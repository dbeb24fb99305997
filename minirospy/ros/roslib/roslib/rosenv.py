"""roslib.rosenv: reads environment variables, under roslib's former function names."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from minirospy.ros.rosgraph.rosgraph import rosenv
from minirospy.ros.rosgraph.rosgraph.rosenv import ROS_HOSTNAME, ROS_IP, ROS_MASTER_URI, ROS_NAMESPACE
from minirospy.ros.rosgraph.rosgraph.roslogging import makedirs_with_parent_perms
from minirospy.ros.roslib.roslib.exceptions import ROSLibException
from minirospy.ros.rospkg.rospkg import environment

__all__ = [
    "ROS_HOME",
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_LOG_DIR",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "ROSEnvException",
    "get_log_dir",
    "get_master_uri",
    "get_ros_home",
    "get_ros_package_path",
    "get_ros_root",
    "get_test_results_dir",
    "makedirs_with_parent_perms",
]

ROS_ROOT = "ROS_ROOT"
ROS_PACKAGE_PATH = "ROS_PACKAGE_PATH"
ROS_HOME = "ROS_HOME"
ROS_LOG_DIR = "ROS_LOG_DIR"


class ROSEnvException(ROSLibException):
    """Raised if a required environment variable is not set."""


def get_ros_root(required: bool = True, env: Mapping[str, str] | None = None) -> str | None:
    """Return ROS_ROOT. If it is not set, raise ROSEnvException if ``required``, else return None."""
    return _variable(ROS_ROOT, required, env)


def get_ros_package_path(required: bool = False, env: Mapping[str, str] | None = None) -> str | None:
    """Return ROS_PACKAGE_PATH. If it is not set, raise ROSEnvException if ``required``, else return None."""
    return _variable(ROS_PACKAGE_PATH, required, env)


def get_master_uri(
    required: bool = True, env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None
) -> str:
    """Return the master URI from the command line or the environment."""
    return rosenv.get_master_uri(env, argv)


def get_ros_home(env: Mapping[str, str] | None = None) -> str:
    """Return ROS_HOME, or ~/.ros if it is not set."""
    return environment.get_ros_home(env)


def get_log_dir(env: Mapping[str, str] | None = None) -> str:
    """Return the folder for log files."""
    return environment.get_log_dir(env)


def get_test_results_dir(env: Mapping[str, str] | None = None) -> str:
    """Return the folder for test results."""
    return environment.get_test_results_dir(env)


def _variable(name: str, required: bool, env: Mapping[str, str] | None) -> str | None:
    value = (os.environ if env is None else env).get(name)
    if required and not value:
        raise ROSEnvException(f"The {name} environment variable has not been set.")
    return value
