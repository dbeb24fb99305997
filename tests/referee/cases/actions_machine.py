"""The state machines, every state with every event: CommStateMachine of a client, ServerGoalHandle of a server."""

import threading

import actionlib
import rospy
from action_peer import Story, name_of
from actionlib import CommState
from actionlib.msg import (
    TestActionFeedback,
    TestActionGoal,
    TestActionResult,
    TestFeedback,
    TestGoal,
    TestResult,
)
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from referee import show

rospy.init_node("case", argv=[], disable_rosout=True)
story = Story()


def action_goal():
    return TestActionGoal(goal_id=GoalID(id="g1", stamp=rospy.Time(5)), goal=TestGoal(7))


def machine(state):
    made = actionlib.CommStateMachine(
        action_goal(),
        lambda handle: story.say("changed", CommState.to_string(handle.get_comm_state())),
        lambda handle, feedback: story.say("feedback", feedback.feedback),
        lambda goal: story.say("send"),
        lambda goal_id: story.say("send cancel", goal_id.id, goal_id.stamp),
    )
    made.state = state
    return made


def tell(made):
    story.tell()
    status = made.latest_goal_status
    show(
        "   now",
        CommState.to_string(made.state),
        name_of(status.status),
        status.text,
        made.latest_result is not None,
    )


# Real actionlib logs a wrong name for PENDING in one line; LOST is not a state of a machine.
STATES = range(8)
for state in STATES:
    for status in range(10):
        show(CommState.to_string(state), "and status", name_of(status))
        made = machine(state)
        if status == 0 and state in (2, 3, 5, 6):
            continue
        others = [GoalStatus(GoalID(id="other"), 1, "")]
        made.update_status(
            GoalStatusArray(status_list=[*others, GoalStatus(GoalID(id="g1"), status, "text")])
        )
        tell(made)
        show(CommState.to_string(state), "and result", name_of(status))
        made = machine(state)
        made.update_result(TestActionResult(status=GoalStatus(GoalID(id="g1"), status, "text")))
        tell(made)
    show(CommState.to_string(state), "and a list without it")
    made = machine(state)
    made.update_status(GoalStatusArray())
    tell(made)
    show(CommState.to_string(state), "and another's result and feedback, and its own")
    made.update_result(TestActionResult(status=GoalStatus(GoalID(id="g2"), 3, "")))
    made = machine(state)
    for id in ("g2", "g1"):
        made.update_feedback(
            TestActionFeedback(status=GoalStatus(GoalID(id=id), 1, ""), feedback=TestFeedback(9))
        )
    tell(made)
    if state != CommState.DONE:
        show(CommState.to_string(state), "and cancel")
        made = machine(state)
        actionlib.ClientGoalHandle(made).cancel()
        tell(made)

for status in range(10):
    made = machine(CommState.DONE)
    made.latest_goal_status.status = status
    show(
        name_of(status),
        "is the terminal state",
        name_of(actionlib.ClientGoalHandle(made).get_terminal_state()),
    )
    story.tell()
handle = actionlib.ClientGoalHandle(made)
handle.comm_state_machine = None
show(handle.get_comm_state(), handle.get_goal_status(), handle.get_goal_status_text())
show(handle.get_result(), handle.get_terminal_state())
story.tell()


class Server:
    """The part of a server that a handle uses."""

    ActionResultType = TestResult

    def __init__(self):
        self.lock = threading.RLock()

    def publish_result(self, status, result):
        story.say("publish result", name_of(status.status), status.text, result.result)

    def publish_feedback(self, status, feedback):
        story.say("publish feedback", name_of(status.status), feedback.feedback)

    def publish_status(self):
        story.say("publish status")


CALLS = {
    "set_accepted": lambda handle: handle.set_accepted("text"),
    "set_canceled": lambda handle: handle.set_canceled(TestResult(3), "text"),
    "set_rejected": lambda handle: handle.set_rejected(None, "text"),
    "set_aborted": lambda handle: handle.set_aborted(TestResult(4)),
    "set_succeeded": lambda handle: handle.set_succeeded(),
    "set_cancel_requested": lambda handle: handle.set_cancel_requested(),
    "publish_feedback": lambda handle: handle.publish_feedback(TestFeedback(5)),
}
for name, call in CALLS.items():
    for status in range(10):
        tracker = actionlib.StatusTracker(None, None, action_goal())
        tracker.status.status = status
        tracker.status.text = "before"
        show(name, "and", name_of(status), "gives", call(actionlib.ServerGoalHandle(tracker, Server(), None)))
        story.tell()
        show(
            "   now",
            name_of(tracker.status.status),
            tracker.status.text,
            tracker.handle_destruction_time.to_sec() > 0,
        )
handle = actionlib.ServerGoalHandle()
show(handle.set_accepted(), handle.set_cancel_requested(), handle.get_goal())
show(handle.get_goal_id().id == "", handle.get_goal_status().status, handle == actionlib.ServerGoalHandle())
handle.publish_feedback(TestFeedback())
