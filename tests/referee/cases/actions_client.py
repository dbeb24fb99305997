"""ActionClient: several goals at a time, their handles, the callbacks; a handle that is dropped."""

import gc

import actionlib
import rospy
from action_peer import RawServer, Story, name_of
from actionlib import CommState, TerminalState
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus
from referee import eventually, outcome, show

rospy.init_node("case", argv=[], disable_rosout=True)
story = Story()
client = actionlib.ActionClient("server", TestAction)
server = RawServer("server")
show(server.connected())
S = GoalStatus


def changed(handle):
    story.say("changed", CommState.to_string(handle.get_comm_state()), name_of(handle.get_goal_status()))


def feedback(handle, message):
    story.say("feedback", message.feedback, CommState.to_string(handle.get_comm_state()))


def ids():
    return [goal.goal_id.id for goal in server.goals]


first = client.send_goal(TestGoal(1), changed, feedback)
show(server.wait_goals(1))
second = client.send_goal(TestGoal(2), transition_cb=changed)
show(server.wait_goals(2))
quiet = client.send_goal(TestGoal(3))
show(server.wait_goals(3), len(set(ids())))
goal = server.goals[0]
show(
    goal.header.seq,
    goal.header.frame_id == "",
    abs(goal.header.stamp.to_sec() - goal.goal_id.stamp.to_sec()) < 1,
)

show("== statuses of all in one list")
server.status((ids()[0], S.ACTIVE, "a"), (ids()[1], S.PENDING, "b"), (ids()[2], S.REJECTED, "c"))
show(story.wait(2), eventually(lambda: quiet.get_comm_state() == CommState.WAITING_FOR_RESULT))
story.tell()
for handle in (first, second, quiet):
    show(name_of(handle.get_goal_status()), handle.get_goal_status_text(), handle.get_result())

show("== feedback, result")
server.feedback(ids()[0], 5)
server.feedback(ids()[1], 6)
show(story.wait(1))
server.result(ids()[1], S.SUCCEEDED, "done", 2)
show(eventually(lambda: second.get_comm_state() == CommState.DONE), story.wait(4))
story.tell()
show(TerminalState.to_string(second.get_terminal_state()), second.get_result().result)
outcome("terminal state of one that runs", first.get_terminal_state)
story.tell()

show("== cancel one")
first.cancel()
show(
    server.wait_cancels(1), server.cancels[0].id == ids()[0], server.cancels[0].stamp.to_sec(), story.wait(1)
)
server.status((ids()[0], S.PREEMPTING, ""))
show(story.wait(2))
server.result(ids()[0], S.PREEMPTED, "stopped", 1)
show(eventually(lambda: first.get_comm_state() == CommState.DONE), story.wait(4))
story.tell()
show(TerminalState.to_string(first.get_terminal_state()), first.get_goal_status_text())

show("== lost, and a status of another")
third = client.send_goal(TestGoal(4), changed)
show(server.wait_goals(4))
server.status((ids()[3], S.ACTIVE, ""))
show(story.wait(1))
server.status((ids()[0], S.PREEMPTED, ""))
show(story.wait(2))
story.tell()
show(TerminalState.to_string(third.get_terminal_state()))

show("== equal handles")
show(
    first == actionlib.ClientGoalHandle(first.comm_state_machine),
    first == second,
    first != second,
    first is None,
    len({first, second, first}),
)

show("== a handle that is dropped is not notified any more")
fourth = client.send_goal(TestGoal(5), changed)
show(server.wait_goals(5))
del fourth
gc.collect()
fifth = client.send_goal(TestGoal(6), changed)
show(server.wait_goals(6))
server.result(ids()[4], S.SUCCEEDED, "")
server.result(ids()[5], S.ABORTED, "")
show(eventually(lambda: fifth.get_comm_state() == CommState.DONE), story.wait(3))
story.tell()

show("== cancels of all and by time")
client.cancel_all_goals()
show(server.wait_cancels(2), repr(server.cancels[1].id), server.cancels[1].stamp)
client.cancel_goals_at_and_before_time(rospy.Time(7))
show(server.wait_cancels(3), repr(server.cancels[2].id), server.cancels[2].stamp)

show("== after stop")
client.stop()
outcome("send_goal", lambda: client.send_goal(TestGoal(7)))
outcome("cancel", lambda: client.cancel_all_goals())
