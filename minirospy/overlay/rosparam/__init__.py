"""rosparam, provided by minirospy: parameters in files and on the server. Source: http://wiki.ros.org/rosparam."""

import yaml as yaml
from rosgraph.names import (
    GLOBALNS,
    get_ros_namespace,
    make_caller_id,
    make_global_ns,
    ns_join,
    script_resolve_name,
)

from minirospy.ros.rosparam.rosparam import (
    NAME,
    NS,
    RosParamException,
    RosParamIOException,
    delete_param,
    dump_params,
    get_param,
    get_param_server,
    list_params,
    load_file,
    load_str,
    print_params,
    set_param,
    set_param_raw,
    upload_params,
    yamlmain,
)

__all__ = [
    "GLOBALNS", "NAME", "NS", "RosParamException", "RosParamIOException", "delete_param", "dump_params", "get_param",
    "get_param_server", "get_ros_namespace", "list_params", "load_file", "load_str", "make_caller_id", "make_global_ns",
    "ns_join", "print_params", "script_resolve_name", "set_param", "set_param_raw", "upload_params", "yamlmain",
]  # fmt: skip
from minirospy.ros.rosparam.rosparam import _fullusage as _fullusage
from minirospy.ros.rosparam.rosparam import _rosparam_cmd_delete as _rosparam_cmd_delete
from minirospy.ros.rosparam.rosparam import _rosparam_cmd_get_dump as _rosparam_cmd_get_dump
from minirospy.ros.rosparam.rosparam import _rosparam_cmd_list as _rosparam_cmd_list
from minirospy.ros.rosparam.rosparam import _rosparam_cmd_set_load as _rosparam_cmd_set_load
