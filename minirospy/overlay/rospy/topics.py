"""rospy.topics, provided by minirospy."""

from minirospy.base.errors import ROSSerializationException as ROSSerializationException
from minirospy.base.errors import TransportTerminated as TransportTerminated
from minirospy.client.publisher import PublishedTopic as _PublisherImpl
from minirospy.client.subscriber import SubscribedTopic as _SubscriberImpl
from minirospy.client.topic import SharedTopic as _TopicImpl
from minirospy.client.topics import Publisher as Publisher
from minirospy.client.topics import SubscribeListener as SubscribeListener
from minirospy.client.topics import Subscriber as Subscriber
from minirospy.client.topics import Topic as Topic
from minirospy.core.idl.message import Message as Message
from minirospy.core.idl.message import args_kwds_to_message as args_kwds_to_message
from minirospy.ros.rospy.rospy.core import topics_logger as _logger
from minirospy.ros.rospy.rospy.msg import serialize_message as serialize_message
from minirospy.ros.rospy.rospy.passing import topics_dir as __dir__
from minirospy.ros.rospy.rospy.passing import topics_getattr as __getattr__
from rospy.impl.registration import Registration as Registration
from rospy.impl.registration import get_topic_manager as get_topic_manager
from rospy.impl.tcpros_base import DEFAULT_BUFF_SIZE as DEFAULT_BUFF_SIZE
