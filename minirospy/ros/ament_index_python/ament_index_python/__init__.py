"""The index of packages by which PyPI's xacro resolves `$(find PACKAGE)`: a look-up in the packages that we find.

xacro is made for both ROS 1 and 2, and its release on PyPI looks packages up as ROS 2 does. With a real ROS 2 in the
environment its own module comes first.
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
