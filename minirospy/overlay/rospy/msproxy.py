"""rospy.msproxy, filled in by minirospy."""

from minirospy.client.msproxy import MasterProxy

__all__ = ["MasterProxy"]
