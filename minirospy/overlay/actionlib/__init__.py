"""actionlib, provided by minirospy.

Without a list of its names, as in ROS: `from actionlib import *` brings GoalStatus and the modules, too, those of the
standard library and rospy included, on which programs have come to rely.
"""

import threading as threading
import time as time
import traceback as traceback
import weakref as weakref

import rospy as rospy
from actionlib_msgs.msg import GoalID as GoalID
from actionlib_msgs.msg import GoalStatus as GoalStatus
from actionlib_msgs.msg import GoalStatusArray as GoalStatusArray
from std_msgs.msg import Header as Header

from actionlib import action_client as action_client
from actionlib import action_server as action_server
from actionlib import exceptions as exceptions
from actionlib import goal_id_generator as goal_id_generator
from actionlib import handle_tracker_deleter as handle_tracker_deleter
from actionlib import server_goal_handle as server_goal_handle
from actionlib import simple_action_client as simple_action_client
from actionlib import simple_action_server as simple_action_server
from actionlib import status_tracker as status_tracker
from minirospy.actionlib import INVALID_TRANSITION as INVALID_TRANSITION
from minirospy.actionlib import NO_TRANSITION as NO_TRANSITION
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
from minirospy.actionlib import g_goal_id as g_goal_id
from minirospy.actionlib import get_name_of_constant as get_name_of_constant
from minirospy.actionlib import nop_cb as nop_cb
