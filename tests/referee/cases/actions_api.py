"""The contents of `import actionlib`: names, signatures, constants, the names of constants."""

import importlib
import inspect

import actionlib
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from referee import outcome, show

MODULES = {
    "actionlib": (
        "ActionClient ActionException ActionServer ClientGoalHandle CommState CommStateMachine GoalIDGenerator "
        "GoalManager HandleTrackerDeleter ServerGoalHandle SimpleActionClient SimpleActionServer SimpleGoalState "
        "StatusTracker TerminalState GoalID GoalStatus GoalStatusArray Header get_name_of_constant nop_cb"
    ),
    "actionlib.action_client": (
        "ActionClient ClientGoalHandle CommState CommStateMachine GoalManager TerminalState get_name_of_constant"
    ),
    "actionlib.action_server": "ActionServer nop_cb",
    "actionlib.exceptions": "ActionException",
    "actionlib.goal_id_generator": "GoalIDGenerator",
    "actionlib.handle_tracker_deleter": "HandleTrackerDeleter",
    "actionlib.server_goal_handle": "ServerGoalHandle",
    "actionlib.simple_action_client": (
        "SimpleActionClient SimpleGoalState ActionClient CommState GoalStatus get_name_of_constant"
    ),
    "actionlib.simple_action_server": "SimpleActionServer ActionServer GoalStatus ServerGoalHandle nop_cb",
    "actionlib.status_tracker": "StatusTracker",
}
for module, names in MODULES.items():
    found = importlib.import_module(module)
    show(module, [name for name in names.split() if not hasattr(found, name)])


def parameters(function):
    """Return the parameters without their types."""
    return [
        (p.name, p.kind.name)
        + ((repr(p.default),) if p.default is not p.empty and not callable(p.default) else ())
        for p in inspect.signature(function).parameters.values()
    ]


CLASSES = [
    actionlib.ActionClient,
    actionlib.ActionServer,
    actionlib.ClientGoalHandle,
    actionlib.CommStateMachine,
    actionlib.GoalIDGenerator,
    actionlib.GoalManager,
    actionlib.ServerGoalHandle,
    actionlib.SimpleActionClient,
    actionlib.SimpleActionServer,
    actionlib.StatusTracker,
]
PUBLIC = {
    "ActionClient": (
        "__init__ stop send_goal cancel_all_goals cancel_goals_at_and_before_time wait_for_server "
        "wait_for_action_server_to_start"
    ),
    "ActionServer": (
        "__init__ register_goal_callback register_cancel_callback start stop initialize publish_result "
        "publish_feedback internal_cancel_callback internal_goal_callback publish_status"
    ),
    "ClientGoalHandle": (
        "__init__ cancel get_comm_state get_goal_status get_goal_status_text get_result get_terminal_state"
    ),
    "CommStateMachine": "__init__ set_state update_status transition_to update_result update_feedback",
    "GoalIDGenerator": "__init__ set_name generate_ID",
    "GoalManager": (
        "__init__ register_send_goal_fn register_cancel_fn init_goal update_statuses update_results "
        "update_feedbacks"
    ),
    "ServerGoalHandle": (
        "__init__ get_default_result set_accepted set_canceled set_rejected set_aborted set_succeeded "
        "publish_feedback get_goal get_goal_id get_goal_status set_cancel_requested"
    ),
    "SimpleActionClient": (
        "__init__ wait_for_server send_goal send_goal_and_wait wait_for_result get_result get_state "
        "get_goal_status_text cancel_all_goals cancel_goals_at_and_before_time cancel_goal stop_tracking_goal"
    ),
    "SimpleActionServer": (
        "__init__ accept_new_goal is_new_goal_available is_preempt_requested is_active set_succeeded set_aborted "
        "publish_feedback get_default_result set_preempted register_goal_callback register_preempt_callback "
        "start internal_goal_callback internal_preempt_callback executeLoop"
    ),
    "StatusTracker": "__init__",
}
for cls in CLASSES:
    for name in PUBLIC[cls.__name__].split():
        show(cls.__name__, name, *parameters(getattr(cls, name)))

for cls in (actionlib.CommState, actionlib.TerminalState, actionlib.SimpleGoalState):
    constants = {name: value for name, value in vars(cls).items() if name.isupper()}
    show(cls.__name__, sorted(constants.items()))
    show([cls.to_string(value) for value in range(-1, 11)])
show(actionlib.get_name_of_constant(GoalStatus, 3), actionlib.get_name_of_constant(GoalStatus, 33))
show(issubclass(actionlib.ActionException, Exception))

rospy.init_node("case", argv=[], disable_rosout=True)
generator = actionlib.GoalIDGenerator()
show(generator.name)
first, second = generator.generate_ID(), generator.generate_ID()
show(type(first) is GoalID, first.id.split("-")[:2], second.id.split("-")[:2])
show(first.id.split("-")[2] == f"{first.stamp.secs}.{first.stamp.nsecs}")
generator.set_name("other")
show(generator.generate_ID().id.split("-")[:2])
show(actionlib.GoalIDGenerator("named").generate_ID().id.split("-")[:2])
outcome("no action", lambda: actionlib.GoalManager(GoalID))
tracker = actionlib.StatusTracker(GoalID(id="x", stamp=rospy.Time(3)), GoalStatus.RECALLING)
show(tracker.status.goal_id.id, tracker.status.goal_id.stamp, tracker.status.status, tracker.goal)
show(tracker.handle_destruction_time)
