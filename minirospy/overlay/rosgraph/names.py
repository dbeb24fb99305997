"""rosgraph.names, provided by minirospy."""

from minirospy.ros.ros_names import (
    GLOBALNS,
    PRIV_NAME,
    REMAP,
    SEP,
    canonicalize_name,
    get_ros_namespace,
    is_global,
    is_private,
    isstring,
    load_mappings,
    make_global_ns,
    namespace,
    ns_join,
)
from minirospy.ros.rosgraph.rosgraph.names import (
    ANYTYPE,
    BASE_NAME_LEGAL_CHARS_P,
    MSG_EXT,
    NAME_LEGAL_CHARS_P,
    REMAP_PATTERN,
    SRV_EXT,
    anonymous_name,
    is_legal_base_name,
    is_legal_name,
    is_legal_remap,
    make_caller_id,
    resolve_name,
    script_resolve_name,
)
from rosgraph.rosenv import ROS_NAMESPACE

__all__ = [
    "ANYTYPE", "BASE_NAME_LEGAL_CHARS_P", "GLOBALNS", "MSG_EXT", "NAME_LEGAL_CHARS_P", "PRIV_NAME", "REMAP", "REMAP_PATTERN",
    "ROS_NAMESPACE", "SEP", "SRV_EXT", "anonymous_name", "canonicalize_name", "get_ros_namespace", "is_global",
    "is_legal_base_name", "is_legal_name", "is_legal_remap", "is_private", "isstring", "load_mappings", "make_caller_id",
    "make_global_ns", "namespace", "ns_join", "resolve_name", "script_resolve_name",
]  # fmt: skip
