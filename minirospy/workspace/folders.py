"""The folders for ROS's files, from the environment: ROS_HOME and the folders in it.

Source: http://wiki.ros.org/ROS/EnvironmentVariables.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

__all__ = ["distro_codename", "log_dir", "results_dir", "ros_home"]


def ros_home(environ: Mapping[str, str] | None = None) -> str:
    """Return the folder set by ROS_HOME, by default ``~/.ros``."""
    return _environ(environ).get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")


def log_dir(environ: Mapping[str, str] | None = None) -> str:
    """Return the folder set by ROS_LOG_DIR, by default ``log`` in ROS_HOME."""
    return _environ(environ).get("ROS_LOG_DIR") or os.path.join(ros_home(environ), "log")


def results_dir(environ: Mapping[str, str] | None = None) -> str:
    """Return the folder set by ROS_TEST_RESULTS_DIR, by default ``test_results`` in ROS_HOME."""
    return _environ(environ).get("ROS_TEST_RESULTS_DIR") or os.path.join(ros_home(environ), "test_results")


def distro_codename(environ: Mapping[str, str] | None = None) -> str:
    """Return the value of ROS_DISTRO, by default the last ROS 1 distribution."""
    return _environ(environ).get("ROS_DISTRO") or "noetic"


def _environ(environ: Mapping[str, str] | None) -> Mapping[str, str]:
    return os.environ if environ is None else environ
