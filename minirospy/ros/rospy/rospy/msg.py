"""Reads and writes messages with a length prefix, like rospy.msg. Source: http://wiki.ros.org/ROS/TCPROS."""

from minirospy.client.length_prefix import deserialize_messages, serialize_message
from minirospy.client.topics import AnyMsg
from minirospy.core.idl.message import args_kwds_to_message

__all__ = ["AnyMsg", "args_kwds_to_message", "deserialize_messages", "serialize_message"]
