"""rospy.topics, filled in by minirospy."""

from minirospy.client.msg import serialize_message
from minirospy.client.topics import Publisher, SubscribeListener, Subscriber, Topic
from minirospy.errors import ROSSerializationException, TransportTerminated
from minirospy.idl.message import Message, args_kwds_to_message
from rospy import core as _core
from rospy.core import *  # noqa: F403
from rospy.impl.registration import Registration, get_topic_manager
from rospy.impl.tcpros_base import DEFAULT_BUFF_SIZE

__all__ = [
    "DEFAULT_BUFF_SIZE", "Message", "Publisher", "ROSSerializationException", "Registration",
    "SubscribeListener", "Subscriber", "Topic", "TransportTerminated", "args_kwds_to_message", "get_topic_manager",
    "serialize_message",
]  # fmt: skip
__all__ += _core.__all__
