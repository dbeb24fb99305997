"""rospy, filled in by minirospy."""

from minirospy.client import *
from minirospy.client import __all__ as __all__
from std_msgs.msg import Header as Header
