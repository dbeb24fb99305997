"""rosservice, provided by minirospy: queries about services, and calls. Source: http://wiki.ros.org/rosservice."""

from minirospy.ros.rosservice.rosservice import (
    NAME,
    ROSServiceException,
    ROSServiceIOException,
    call_service,
    get_service_args,
    get_service_class_by_name,
    get_service_headers,
    get_service_list,
    get_service_node,
    get_service_type,
    get_service_uri,
    has_service_args,
    rosservice_find,
    rosservicemain,
)

__all__ = [
    "NAME", "ROSServiceException", "ROSServiceIOException", "call_service", "get_service_args",
    "get_service_class_by_name", "get_service_headers", "get_service_list", "get_service_node", "get_service_type",
    "get_service_uri", "has_service_args", "rosservice_find", "rosservicemain",
]  # fmt: skip
from minirospy.ros.rosservice.rosservice import _fullusage as _fullusage
from minirospy.ros.rosservice.rosservice import _get_master as _get_master
from minirospy.ros.rosservice.rosservice import _rosservice_cmd_args as _rosservice_cmd_args
from minirospy.ros.rosservice.rosservice import _rosservice_cmd_call as _rosservice_cmd_call
from minirospy.ros.rosservice.rosservice import _rosservice_cmd_find as _rosservice_cmd_find
from minirospy.ros.rosservice.rosservice import _rosservice_cmd_info as _rosservice_cmd_info
from minirospy.ros.rosservice.rosservice import _rosservice_cmd_list as _rosservice_cmd_list
from minirospy.ros.rosservice.rosservice import _rosservice_cmd_node as _rosservice_cmd_node
from minirospy.ros.rosservice.rosservice import _rosservice_cmd_type as _rosservice_cmd_type
from minirospy.ros.rosservice.rosservice import _rosservice_cmd_uri as _rosservice_cmd_uri
