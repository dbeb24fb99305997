"""rospkg: finds packages and their dependencies."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.rospkg.rospkg import common, environment, manifest, rospack
    from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE, PACKAGE_FILE, STACK_FILE, ResourceNotFound
    from minirospy.ros.rospkg.rospkg.environment import (
        get_etc_ros_dir,
        get_log_dir,
        get_ros_home,
        get_ros_package_path,
        get_ros_paths,
        get_ros_root,
        get_test_results_dir,
        on_ros_path,
    )
    from minirospy.ros.rospkg.rospkg.manifest import InvalidManifest, Manifest, parse_manifest_file
    from minirospy.ros.rospkg.rospkg.rospack import (
        RosPack,
        RosStack,
        expand_to_packages,
        get_package_name,
        get_stack_version_by_dir,
        list_by_path,
    )

__all__ = [
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "STACK_FILE",
    "InvalidManifest",
    "Manifest",
    "ResourceNotFound",
    "RosPack",
    "RosStack",
    "__version__",
    "common",
    "environment",
    "expand_to_packages",
    "get_etc_ros_dir",
    "get_log_dir",
    "get_package_name",
    "get_ros_home",
    "get_ros_package_path",
    "get_ros_paths",
    "get_ros_root",
    "get_stack_version_by_dir",
    "get_test_results_dir",
    "list_by_path",
    "manifest",
    "on_ros_path",
    "parse_manifest_file",
    "rospack",
]

__version__ = "1.4.0"
