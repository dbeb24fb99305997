"""rosservice, provided by minirospy: queries about services, and calls. Source: http://wiki.ros.org/rosservice."""

from minirospy.compat.rosservice import (
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
