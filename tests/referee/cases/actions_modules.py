"""The modules of actionlib that programs use after `import actionlib`."""

import actionlib
import rospy
from actionlib import *  # noqa: F403
from actionlib.action_client import ActionClient, CommState, GoalManager, get_name_of_constant
from actionlib.action_server import GoalStatus as ServerStatus
from actionlib.simple_action_client import SimpleGoalState
from referee import show

show(SimpleActionClient is actionlib.SimpleActionClient, GoalStatus.SUCCEEDED)  # noqa: F405
show(
    actionlib.simple_action_client.GoalStatus.SUCCEEDED,
    ServerStatus.ABORTED,
    actionlib.action_client.GoalStatus.LOST,
)
show(actionlib.simple_action_client.SimpleGoalState.DONE == SimpleGoalState.DONE)
show(actionlib.action_client.ActionClient is ActionClient is actionlib.ActionClient)
show(CommState.to_string(CommState.ACTIVE), callable(GoalManager), get_name_of_constant(CommState, 99))
names = (
    "action_client action_server exceptions goal_id_generator handle_tracker_deleter server_goal_handle "
    "simple_action_client simple_action_server status_tracker"
)
for name in names.split():
    show(name, getattr(actionlib, name).__name__)
show(actionlib.exceptions.ActionException is actionlib.ActionException, rospy.is_shutdown())
show(*(name for name in ("rospy", "threading", "time", "traceback", "weakref") if name in globals()))
