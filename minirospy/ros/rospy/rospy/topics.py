"""Provides the names in ROS's module rospy.topics."""

from minirospy.base.errors import ROSSerializationException, TransportTerminated
from minirospy.client.publisher import PublishedTopic as _PublisherImpl
from minirospy.client.subscriber import SubscribedTopic as _SubscriberImpl
from minirospy.client.topic import SharedTopic as _TopicImpl
from minirospy.client.topics import Publisher, SubscribeListener, Subscriber, Topic
from minirospy.core.idl.message import Message, args_kwds_to_message
from minirospy.ros.rospy.rospy.core import topics_logger as _logger
from minirospy.ros.rospy.rospy.impl.registration import Registration, get_topic_manager
from minirospy.ros.rospy.rospy.impl.transport import DEFAULT_BUFF_SIZE
from minirospy.ros.rospy.rospy.msg import serialize_message

__all__ = [
    "DEFAULT_BUFF_SIZE",
    "Message",
    "Publisher",
    "ROSSerializationException",
    "Registration",
    "SubscribeListener",
    "Subscriber",
    "Topic",
    "TransportTerminated",
    "_PublisherImpl",
    "_SubscriberImpl",
    "_TopicImpl",
    "_logger",
    "args_kwds_to_message",
    "get_topic_manager",
    "serialize_message",
]
