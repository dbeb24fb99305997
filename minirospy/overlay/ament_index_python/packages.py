"""ament_index_python.packages, provided by minirospy where there is no ROS 2."""

from minirospy.ros.ament_index_python.ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
    get_package_share_path,
    get_packages_with_prefixes,
)

__all__ = [
    "PackageNotFoundError", "get_package_prefix", "get_package_share_directory", "get_package_share_path",
    "get_packages_with_prefixes",
]  # fmt: skip
