"""rospkg.rospack, provided by minirospy."""

from minirospy.ros.rospkg.rospkg.rospack import (
    ManifestManager,
    RosPack,
    RosStack,
    expand_to_packages,
    get_package_name,
    get_stack_version_by_dir,
    list_by_path,
)

__all__ = [
    "ManifestManager",
    "RosPack",
    "RosStack",
    "expand_to_packages",
    "get_package_name",
    "get_stack_version_by_dir",
    "list_by_path",
]
