"""roslib.packages, provided by minirospy."""

from minirospy.ros.roslib.roslib.packages import (
    ROS_PACKAGE_PATH,
    ROS_ROOT,
    SRC_DIR,
    InvalidROSPkgException,
    MultipleNodesException,
    ROSPkgException,
    _find_resource,
    _get_pkg_subdir_by_dir,
    find_node,
    find_resource,
    get_dir_pkg,
    get_pkg_dir,
    get_pkg_subdir,
    list_pkgs_by_path,
    resource_file,
)
from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE, PACKAGE_FILE

__all__ = [
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "SRC_DIR",
    "InvalidROSPkgException",
    "MultipleNodesException",
    "ROSPkgException",
    "find_node",
    "find_resource",
    "get_dir_pkg",
    "get_pkg_dir",
    "get_pkg_subdir",
    "list_pkgs_by_path",
    "resource_file",
]
