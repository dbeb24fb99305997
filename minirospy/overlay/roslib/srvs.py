"""roslib.srvs, provided by minirospy: the service types of packages."""

from minirospy.ros.roslib.roslib.srvs import (
    COMMENTCHAR,
    EXT,
    IODELIM,
    SEP,
    VERBOSE,
    SrvSpec,
    SrvSpecException,
    get_pkg_srv_specs,
    is_verbose,
    list_srv_types,
    load_from_file,
    load_from_string,
    set_verbose,
    srv_file,
)

__all__ = [
    "COMMENTCHAR",
    "EXT",
    "IODELIM",
    "SEP",
    "VERBOSE",
    "SrvSpec",
    "SrvSpecException",
    "get_pkg_srv_specs",
    "is_verbose",
    "list_srv_types",
    "load_from_file",
    "load_from_string",
    "set_verbose",
    "srv_file",
]
