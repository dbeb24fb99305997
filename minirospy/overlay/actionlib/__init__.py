"""actionlib, filled in by minirospy."""

from actionlib_msgs.msg import GoalID as GoalID
from actionlib_msgs.msg import GoalStatus as GoalStatus
from actionlib_msgs.msg import GoalStatusArray as GoalStatusArray
from std_msgs.msg import Header as Header

from minirospy.actionlib import *  # noqa: F403
from minirospy.actionlib import __all__ as __all__
