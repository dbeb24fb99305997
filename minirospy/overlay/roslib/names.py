"""roslib.names, provided by minirospy: rosgraph's names, and those of resources (``package/name``)."""

from rosgraph.names import (
    ANYTYPE,
    GLOBALNS,
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

from minirospy.ros.roslib.roslib.names import (
    PRN_SEPARATOR,
    TYPE_SEPARATOR,
    is_legal_resource_base_name,
    is_legal_resource_name,
    package_resource_name,
    resource_name,
    resource_name_base,
    resource_name_package,
)

__all__ = [
    "ANYTYPE", "GLOBALNS", "PRIV_NAME", "PRN_SEPARATOR", "REMAP", "SEP", "TYPE_SEPARATOR", "anonymous_name",
    "canonicalize_name", "get_ros_namespace", "is_global", "is_legal_base_name", "is_legal_name",
    "is_legal_resource_base_name", "is_legal_resource_name", "is_private", "load_mappings", "make_caller_id",
    "make_global_ns", "namespace", "ns_join", "package_resource_name", "resolve_name", "resource_name",
    "resource_name_base", "resource_name_package",
]  # fmt: skip
