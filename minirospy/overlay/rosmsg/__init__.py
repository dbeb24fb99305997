"""rosmsg, provided by minirospy: the types that are installed. Source: http://wiki.ros.org/rosmsg."""

from minirospy.compat.rosmsg import (
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
from minirospy.compat.rosmsg import _get_package_paths as _get_package_paths

__all__ = [
    "MODE_MSG", "MODE_SRV", "ROSMsgException", "get_msg_text", "get_srv_text", "get_yaml_for_msg", "iterate_packages",
    "list_msgs", "list_srvs", "list_types", "rosmsg_md5", "rosmsg_search", "rosmsgmain", "spec_to_str",
]  # fmt: skip
