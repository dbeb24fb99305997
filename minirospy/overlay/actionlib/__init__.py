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
from minirospy.ros.actionlib.actionlib import INVALID_TRANSITION as INVALID_TRANSITION
from minirospy.ros.actionlib.actionlib import NO_TRANSITION as NO_TRANSITION
from minirospy.ros.actionlib.actionlib import ActionClient as ActionClient
from minirospy.ros.actionlib.actionlib import ActionException as ActionException
from minirospy.ros.actionlib.actionlib import ActionServer as ActionServer
from minirospy.ros.actionlib.actionlib import ClientGoalHandle as ClientGoalHandle
from minirospy.ros.actionlib.actionlib import CommState as CommState
from minirospy.ros.actionlib.actionlib import CommStateMachine as CommStateMachine
from minirospy.ros.actionlib.actionlib import GoalIDGenerator as GoalIDGenerator
from minirospy.ros.actionlib.actionlib import GoalManager as GoalManager
from minirospy.ros.actionlib.actionlib import HandleTrackerDeleter as HandleTrackerDeleter
from minirospy.ros.actionlib.actionlib import ServerGoalHandle as ServerGoalHandle
from minirospy.ros.actionlib.actionlib import SimpleActionClient as SimpleActionClient
from minirospy.ros.actionlib.actionlib import SimpleActionServer as SimpleActionServer
from minirospy.ros.actionlib.actionlib import SimpleGoalState as SimpleGoalState
from minirospy.ros.actionlib.actionlib import StatusTracker as StatusTracker
from minirospy.ros.actionlib.actionlib import TerminalState as TerminalState
from minirospy.ros.actionlib.actionlib import g_goal_id as g_goal_id
from minirospy.ros.actionlib.actionlib import get_name_of_constant as get_name_of_constant
from minirospy.ros.actionlib.actionlib import nop_cb as nop_cb
