"""rospy.msg, filled in by minirospy."""

from minirospy.client.topics import AnyMsg

__all__ = ["AnyMsg"]
