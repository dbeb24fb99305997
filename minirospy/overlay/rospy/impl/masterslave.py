"""rospy.impl.masterslave, provided by minirospy: the Slave API of this process."""

from minirospy.ros.rospy.rospy.impl.masterslave import LOG_API, MSG, STATUS, VAL, ROSHandler

__all__ = [
    "LOG_API",
    "MSG",
    "STATUS",
    "VAL",
    "ROSHandler",
]
