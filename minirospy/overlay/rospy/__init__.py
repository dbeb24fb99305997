"""rospy, filled in by minirospy."""

from std_msgs.msg import Header as Header

from minirospy.client import *  # noqa: F403
from minirospy.client import __all__ as __all__
from rospy import client as client
from rospy import core as core
from rospy import exceptions as exceptions
from rospy import impl as impl
from rospy import msg as msg
from rospy import msproxy as msproxy
from rospy import names as names
from rospy import rostime as rostime
from rospy import service as service
from rospy import timer as timer
from rospy import topics as topics

__all__ += ["Header"]
