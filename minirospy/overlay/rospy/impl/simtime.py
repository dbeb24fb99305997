"""rospy.impl.simtime, provided by minirospy."""

from minirospy.ros.rospy.rospy.impl.simtime import init_simtime

__all__ = ["init_simtime"]
