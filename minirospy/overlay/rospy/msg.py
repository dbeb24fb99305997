"""rospy.msg, provided by minirospy."""

from minirospy.client.topics import AnyMsg
from minirospy.compat.rospy.msg import deserialize_messages, serialize_message
from minirospy.core.idl.message import args_kwds_to_message

__all__ = ["AnyMsg", "args_kwds_to_message", "deserialize_messages", "serialize_message"]
