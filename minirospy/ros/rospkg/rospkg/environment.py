"""rospkg.environment: the names and values of environment variables."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

from minirospy.workspace import folders
from minirospy.workspace.packages import built_in_roots

__all__ = [
    "ROS_ETC_DIR",
    "ROS_HOME",
    "ROS_LOG_DIR",
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "ROS_TEST_RESULTS_DIR",
    "_compute_package_paths",
    "_resolve_path",
    "_resolve_paths",
    "get_etc_ros_dir",
    "get_log_dir",
    "get_ros_home",
    "get_ros_package_path",
    "get_ros_paths",
    "get_ros_root",
    "get_test_results_dir",
    "on_ros_path",
]

Environ = Mapping[str, str]

ROS_ROOT = "ROS_ROOT"
ROS_PACKAGE_PATH = "ROS_PACKAGE_PATH"
ROS_HOME = "ROS_HOME"
ROS_ETC_DIR = "ROS_ETC_DIR"
ROS_LOG_DIR = "ROS_LOG_DIR"
ROS_TEST_RESULTS_DIR = "ROS_TEST_RESULTS_DIR"


def _compute_package_paths(ros_root: str | None, ros_package_path: str | None) -> list[str]:
    """Return the folders listed in ROS_ROOT and ROS_PACKAGE_PATH."""
    named = (ros_package_path or "").split(os.pathsep)
    return [path for path in (ros_root or "", *named) if path.strip()]


def _resolve_path(p: str) -> str:
    """Expand ``~`` at the start of a path from an environment variable."""
    return os.path.expanduser(p) if p and p[0] == "~" else p


def _resolve_paths(paths: str) -> str:
    """Expand ``~`` at the start of each path from an environment variable."""
    return os.pathsep.join(_resolve_path(path) for path in paths.split(os.pathsep) if path)


def get_ros_root(env: Environ | None = None) -> str | None:
    """Return ROS_ROOT, or None if it is not set."""
    return _environ(env).get("ROS_ROOT")


def get_ros_package_path(env: Environ | None = None) -> str | None:
    """Return ROS_PACKAGE_PATH, or None if it is not set."""
    return _environ(env).get("ROS_PACKAGE_PATH")


def get_ros_paths(env: Environ | None = None) -> list[str]:
    """Return the folders in ROS_ROOT and ROS_PACKAGE_PATH, then those of minirospy's own packages."""
    named = _compute_package_paths(get_ros_root(env), get_ros_package_path(env))
    return list(dict.fromkeys([*named, *map(str, built_in_roots())]))


def get_ros_home(env: Environ | None = None) -> str:
    """Return ROS_HOME, or ``~/.ros``."""
    return folders.ros_home(env)


def get_log_dir(env: Environ | None = None) -> str:
    """Return ROS_LOG_DIR, or ``log`` in ROS_HOME."""
    return folders.log_dir(env)


def get_test_results_dir(env: Environ | None = None) -> str:
    """Return ROS_TEST_RESULTS_DIR, or ``test_results`` in ROS_HOME."""
    return folders.results_dir(env)


def get_etc_ros_dir(env: Environ | None = None) -> str:
    """Return ROS_ETC_DIR, by default the system's folder for ROS settings."""
    default = r"C:\opt\ros\etc" if sys.platform == "win32" else "/etc/ros"
    return _environ(env).get("ROS_ETC_DIR") or default


def on_ros_path(p: str, env: Environ | None = None) -> bool:
    """Return whether a path is below a folder that is searched for packages."""
    place = Path(p).resolve()
    return any(place.is_relative_to(Path(root).resolve()) for root in get_ros_paths(env))


def _environ(env: Environ | None) -> Environ:
    return os.environ if env is None else env
