"""The message that rospy itself provides, in a separate module that is imported after ROS 1's packages are preferred."""

from std_msgs.msg import Header

__all__ = ["Header"]
