"""rostopic, provided by minirospy: queries about topics, and publishing. Source: http://wiki.ros.org/rostopic."""

import rosgraph as rosgraph

from minirospy.ros.rostopic.rostopic import (
    NAME,
    ROSTopicException,
    ROSTopicIOException,
    create_publisher,
    find_by_type,
    get_api,
    get_info_text,
    get_topic_class,
    get_topic_list,
    get_topic_type,
    msgevalgen,
    publish_message,
    rostopicmain,
)
from minirospy.ros.rostopic.rostopic import _check_master as _check_master
from minirospy.ros.rostopic.rostopic import _get_topic_type as _get_topic_type
from minirospy.ros.rostopic.rostopic import _master_get_topic_types as _master_get_topic_types
from minirospy.ros.rostopic.rostopic import _rostopic_echo as _rostopic_echo
from minirospy.ros.rostopic.rostopic import _rostopic_info as _rostopic_info
from minirospy.ros.rostopic.rostopic import _rostopic_list as _rostopic_list
from minirospy.ros.rostopic.rostopic import _rostopic_type as _rostopic_type
from minirospy.ros.rostopic.rostopic import _sleep as _sleep
from minirospy.ros.rostopic.rostopic.echo import CallbackEcho, create_field_filter, create_value_transform
from minirospy.ros.rostopic.rostopic.rates import ROSTopicBandwidth, ROSTopicDelay, ROSTopicHz

__all__ = [
    "NAME", "CallbackEcho", "ROSTopicBandwidth", "ROSTopicDelay", "ROSTopicException", "ROSTopicHz",
    "ROSTopicIOException", "create_field_filter", "create_publisher", "create_value_transform", "find_by_type",
    "get_api", "get_info_text", "get_topic_class", "get_topic_list", "get_topic_type", "msgevalgen", "publish_message",
    "rostopicmain",
]  # fmt: skip
from minirospy.ros.rostopic.rostopic import _fullusage as _fullusage
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_bw as _rostopic_cmd_bw
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_delay as _rostopic_cmd_delay
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_echo as _rostopic_cmd_echo
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_find as _rostopic_cmd_find
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_hz as _rostopic_cmd_hz
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_info as _rostopic_cmd_info
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_list as _rostopic_cmd_list
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_pub as _rostopic_cmd_pub
from minirospy.ros.rostopic.rostopic import _rostopic_cmd_type as _rostopic_cmd_type
from minirospy.ros.rostopic.rostopic import _rostopic_list_group_by_host as _rostopic_list_group_by_host
