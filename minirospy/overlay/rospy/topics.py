"""rospy.topics, filled in by minirospy."""

from minirospy.client.topics import Publisher, SubscribeListener, Subscriber, Topic

__all__ = ["Publisher", "SubscribeListener", "Subscriber", "Topic"]
