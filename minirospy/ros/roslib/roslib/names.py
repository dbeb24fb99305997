"""roslib.names: rosgraph's functions for names, and resource names (``package/name``)."""

from minirospy.ros.genmsg.genmsg.names import (
    BASE_RESOURCE_NAME_LEGAL_CHARS_P,
    PRN_SEPARATOR,
    RESOURCE_NAME_LEGAL_CHARS_P,
    is_legal_resource_base_name,
    is_legal_resource_name,
    package_resource_name,
    resource_name,
    resource_name_base,
    resource_name_package,
)
from minirospy.ros.rosgraph.rosgraph.names import (
    ANYTYPE,
    BASE_NAME_LEGAL_CHARS_P,
    GLOBALNS,
    NAME_LEGAL_CHARS_P,
    PRIV_NAME,
    REMAP,
    SEP,
    anonymous_name,
    canonicalize_name,
    get_ros_namespace,
    is_global,
    is_legal_base_name,
    is_legal_name,
    is_private,
    load_mappings,
    make_caller_id,
    make_global_ns,
    namespace,
    ns_join,
    resolve_name,
)

__all__ = [
    "ANYTYPE",
    "BASE_NAME_LEGAL_CHARS_P",
    "BASE_RESOURCE_NAME_LEGAL_CHARS_P",
    "GLOBALNS",
    "NAME_LEGAL_CHARS_P",
    "PRIV_NAME",
    "PRN_SEPARATOR",
    "REMAP",
    "RESOURCE_NAME_LEGAL_CHARS_P",
    "SEP",
    "TYPE_SEPARATOR",
    "anonymous_name",
    "canonicalize_name",
    "get_ros_namespace",
    "is_global",
    "is_legal_base_name",
    "is_legal_name",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "is_private",
    "isstring",
    "load_mappings",
    "make_caller_id",
    "make_global_ns",
    "namespace",
    "ns_join",
    "package_resource_name",
    "resolve_name",
    "resource_name",
    "resource_name_base",
    "resource_name_package",
]

TYPE_SEPARATOR = PRN_SEPARATOR


def isstring(s: object) -> bool:
    """Return whether a value is a str."""
    return isinstance(s, str)
