"""actionlib, filled in by minirospy."""

from actionlib_msgs.msg import GoalID as GoalID
from actionlib_msgs.msg import GoalStatus as GoalStatus
from actionlib_msgs.msg import GoalStatusArray as GoalStatusArray
from std_msgs.msg import Header as Header

from minirospy.actionlib import ActionClient as ActionClient
from minirospy.actionlib import ActionException as ActionException
from minirospy.actionlib import ActionServer as ActionServer
from minirospy.actionlib import ClientGoalHandle as ClientGoalHandle
from minirospy.actionlib import CommState as CommState
from minirospy.actionlib import CommStateMachine as CommStateMachine
from minirospy.actionlib import GoalIDGenerator as GoalIDGenerator
from minirospy.actionlib import GoalManager as GoalManager
from minirospy.actionlib import HandleTrackerDeleter as HandleTrackerDeleter
from minirospy.actionlib import ServerGoalHandle as ServerGoalHandle
from minirospy.actionlib import SimpleActionClient as SimpleActionClient
from minirospy.actionlib import SimpleActionServer as SimpleActionServer
from minirospy.actionlib import SimpleGoalState as SimpleGoalState
from minirospy.actionlib import StatusTracker as StatusTracker
from minirospy.actionlib import TerminalState as TerminalState
from minirospy.actionlib import __all__ as __all__
from minirospy.actionlib import get_name_of_constant as get_name_of_constant
from minirospy.actionlib import nop_cb as nop_cb
