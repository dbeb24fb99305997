"""ament_index_python, provided by minirospy where there is no ROS 2: PyPI's xacro finds packages by it."""

from ament_index_python import packages as packages
from minirospy.ros.ament_index_python.ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
    get_package_share_path,
    get_packages_with_prefixes,
)

__all__ = [
    "PackageNotFoundError", "get_package_prefix", "get_package_share_directory", "get_package_share_path",
    "get_packages_with_prefixes", "packages",
]  # fmt: skip
