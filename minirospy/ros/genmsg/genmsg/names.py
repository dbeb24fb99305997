"""genmsg.names: names of resources (``package/name``)."""

from minirospy.ros.roslib.roslib.names import (
    PRN_SEPARATOR,
    is_legal_resource_base_name,
    is_legal_resource_name,
    package_resource_name,
    resource_name,
    resource_name_base,
    resource_name_package,
)

__all__ = [
    "PRN_SEPARATOR",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "package_resource_name",
    "resource_name",
    "resource_name_base",
    "resource_name_package",
]
