"""rospy.msproxy, provided by minirospy."""

from minirospy.ros.rospy.rospy.msproxy import MasterProxy

__all__ = ["MasterProxy"]
