"""rospy.names, provided by minirospy: remappings, and the validation of a call's arguments."""

from minirospy.base.errors import ROSException, ROSInitException
from minirospy.client import get_caller_id, get_name, get_namespace, remap_name, resolve_name
from minirospy.ros.ros_names import (
    GLOBALNS,
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
from minirospy.ros.rospy.rospy.names import (
    ANYTYPE,
    SERVICE_ANYTYPE,
    TOPIC_ANYTYPE,
    ParameterInvalid,
    get_mappings,
    get_resolved_mappings,
    global_name,
    initialize_mappings,
    reload_mappings,
    resolve_name_without_node_name,
    scoped_name,
    valid_name,
    valid_name_validator_resolved,
    valid_name_validator_unresolved,
)
from minirospy.ros.rospy.rospy.names import _set_caller_id as _set_caller_id

__all__ = [
    "ANYTYPE", "GLOBALNS", "REMAP", "SEP", "SERVICE_ANYTYPE", "TOPIC_ANYTYPE", "ParameterInvalid", "ROSException",
    "ROSInitException", "canonicalize_name", "get_caller_id", "get_mappings", "get_name", "get_namespace",
    "get_resolved_mappings", "get_ros_namespace", "global_name", "initialize_mappings", "is_global", "is_private",
    "isstring", "load_mappings", "make_global_ns", "namespace", "ns_join", "reload_mappings", "remap_name",
    "resolve_name", "resolve_name_without_node_name", "scoped_name", "valid_name", "valid_name_validator_resolved",
    "valid_name_validator_unresolved",
]  # fmt: skip
