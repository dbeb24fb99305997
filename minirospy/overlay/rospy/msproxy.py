"""rospy.msproxy, provided by minirospy."""

from minirospy.compat.rospy.msproxy import MasterProxy

__all__ = ["MasterProxy"]
