"""Actions: long-running goals with feedback, a final result, and cancellation.

A goal passes through these functions: client/simple_client `send_goal` -> machine `GoalManager.init_goal` -> topic goal ==>
server `internal_goal_callback` -> simple_server, the user's callback -> handle `set_succeeded` -> topic result ==>
machine `update_result` -> simple_client `_handle_transition`, the user's callback. The state transitions are in
`minirospy.core.graph.goals`. `import actionlib` re-exports this package. Source: http://wiki.ros.org/actionlib.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.ros.actionlib.actionlib.client import ActionClient
from minirospy.ros.actionlib.actionlib.goal_id import GoalIDGenerator
from minirospy.ros.actionlib.actionlib.handle import HandleTrackerDeleter, ServerGoalHandle, StatusTracker
from minirospy.ros.actionlib.actionlib.machine import ClientGoalHandle, CommStateMachine, GoalManager
from minirospy.ros.actionlib.actionlib.server import ActionServer, nop_cb
from minirospy.ros.actionlib.actionlib.simple_client import SimpleActionClient
from minirospy.ros.actionlib.actionlib.simple_server import SimpleActionServer
from minirospy.ros.actionlib.actionlib.spec import ActionException
from minirospy.ros.actionlib.actionlib.states import (
    INVALID_TRANSITION,
    NO_TRANSITION,
    CommState,
    SimpleGoalState,
    TerminalState,
    g_goal_id,
    get_name_of_constant,
)

if TYPE_CHECKING:
    import threading as threading
    import time as time
    import traceback as traceback
    import weakref as weakref

    import rospy as rospy
    from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
    from std_msgs.msg import Header

    from minirospy.ros.actionlib.actionlib import (
        action_client,
        action_server,
        exceptions,
        goal_id_generator,
        handle_tracker_deleter,
        server_goal_handle,
        simple_action_client,
        simple_action_server,
        status_tracker,
    )

__all__ = [
    "INVALID_TRANSITION",
    "NO_TRANSITION",
    "ActionClient",
    "ActionException",
    "ActionServer",
    "ClientGoalHandle",
    "CommState",
    "CommStateMachine",
    "GoalID",
    "GoalIDGenerator",
    "GoalManager",
    "GoalStatus",
    "GoalStatusArray",
    "HandleTrackerDeleter",
    "Header",
    "ServerGoalHandle",
    "SimpleActionClient",
    "SimpleActionServer",
    "SimpleGoalState",
    "StatusTracker",
    "TerminalState",
    "action_client",
    "action_server",
    "exceptions",
    "g_goal_id",
    "get_name_of_constant",
    "goal_id_generator",
    "handle_tracker_deleter",
    "nop_cb",
    "rospy",
    "server_goal_handle",
    "simple_action_client",
    "simple_action_server",
    "status_tracker",
    "threading",
    "time",
    "traceback",
    "weakref",
]
