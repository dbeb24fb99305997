"""rospy.msg, provided by minirospy."""

from minirospy.client.topics import AnyMsg
from minirospy.core.idl.message import args_kwds_to_message
from minirospy.ros.rospy.rospy.msg import deserialize_messages, serialize_message

__all__ = ["AnyMsg", "args_kwds_to_message", "deserialize_messages", "serialize_message"]
