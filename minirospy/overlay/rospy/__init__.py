"""rospy, filled in by minirospy."""

from std_msgs.msg import Header as Header

from minirospy.client import *  # noqa: F403
from minirospy.client import __all__ as __all__
