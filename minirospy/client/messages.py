"""The message that rospy itself defines.

It has a separate module, so that it is imported after ROS 1's packages are preferred.
"""

from std_msgs.msg import Header

__all__ = ["Header"]
