"""The package index that PyPI's xacro uses to resolve `$(find PACKAGE)`. It finds the same packages as minirospy.

xacro supports both ROS 1 and 2, and its PyPI release uses ROS 2's API to find packages. In an environment with ROS 2, the
real module takes precedence.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.ament_index_python.ament_index_python import packages
    from minirospy.ros.ament_index_python.ament_index_python.packages import (
        PackageNotFoundError,
        get_package_prefix,
        get_package_share_directory,
        get_package_share_path,
        get_packages_with_prefixes,
    )

__all__ = [
    "PackageNotFoundError",
    "get_package_prefix",
    "get_package_share_directory",
    "get_package_share_path",
    "get_packages_with_prefixes",
    "packages",
]
