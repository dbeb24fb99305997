"""rosmsg, provided by minirospy: the types that are installed. Source: http://wiki.ros.org/rosmsg."""

from minirospy.ros.rosmsg.rosmsg import (
    MODE_MSG,
    MODE_SRV,
    ROSMsgException,
    get_msg_text,
    get_srv_text,
    get_yaml_for_msg,
    iterate_packages,
    list_msgs,
    list_srvs,
    list_types,
    rosmsg_md5,
    rosmsg_search,
    rosmsgmain,
    spec_to_str,
)
from minirospy.ros.rosmsg.rosmsg import _get_package_paths as _get_package_paths

__all__ = [
    "MODE_MSG", "MODE_SRV", "ROSMsgException", "get_msg_text", "get_srv_text", "get_yaml_for_msg", "iterate_packages",
    "list_msgs", "list_srvs", "list_types", "rosmsg_md5", "rosmsg_search", "rosmsgmain", "spec_to_str",
]  # fmt: skip
from minirospy.ros.rosmsg.rosmsg import _list_resources as _list_resources
from minirospy.ros.rosmsg.rosmsg import _list_types as _list_types
from minirospy.ros.rosmsg.rosmsg import _msg_filter as _msg_filter
from minirospy.ros.rosmsg.rosmsg import rosmsg_cmd_list as rosmsg_cmd_list
from minirospy.ros.rosmsg.rosmsg import rosmsg_cmd_md5 as rosmsg_cmd_md5
from minirospy.ros.rosmsg.rosmsg import rosmsg_cmd_package as rosmsg_cmd_package
from minirospy.ros.rosmsg.rosmsg import rosmsg_cmd_packages as rosmsg_cmd_packages
from minirospy.ros.rosmsg.rosmsg import rosmsg_cmd_show as rosmsg_cmd_show
