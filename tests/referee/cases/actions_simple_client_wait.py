"""SimpleActionClient: blocking calls, timeouts, calls before there is a goal, cancel requests for other clients' goals."""

import threading

import actionlib
import rospy
from action_peer import RawServer, Story, name_of
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus
from referee import outcome, show

rospy.init_node("case", argv=[], disable_rosout=True)
story = Story()
client = actionlib.SimpleActionClient("server", TestAction)
short = rospy.Duration(0.15)

show("== no server")
outcome("wait_for_server", lambda: client.wait_for_server(short))
outcome("wait_for_server", lambda: client.wait_for_server(timeout=rospy.Duration(0, 1)))
outcome("wait_for_server", lambda: client.action_client.wait_for_server(short))
outcome("wait_for_server", lambda: client.action_client.wait_for_action_server_to_start(short))
for name in (
    "get_state",
    "get_result",
    "get_goal_status_text",
    "wait_for_result",
    "cancel_goal",
    "stop_tracking_goal",
):
    outcome(name, getattr(client, name))
outcome("wait_for_result", lambda: client.wait_for_result(short))
story.tell()
client.send_goal(TestGoal(1))
outcome("get_state", client.get_state)
outcome("wait_for_result", lambda: client.wait_for_result(short))
outcome("wait_for_result", lambda: client.wait_for_result(timeout=rospy.Duration(0, 1)))
outcome("send_goal_and_wait", lambda: client.send_goal_and_wait(TestGoal(2), short, short))
story.tell()

show("== a server")
server = RawServer("server")
show(server.connected())
outcome("wait_for_server", lambda: client.wait_for_server(short))
client.stop_tracking_goal()
server.status()
outcome("wait_for_server", lambda: client.wait_for_server(rospy.Duration(30)))
outcome("wait_for_server", lambda: client.wait_for_server())
outcome("wait_for_server", lambda: client.wait_for_action_server_to_start())
story.tell()

S = GoalStatus


def goal_and_wait(goal, *timeouts):
    """Run send_goal_and_wait in a thread; return its result, and the thread."""
    answers = []
    thread = threading.Thread(
        target=lambda: answers.append(name_of(client.send_goal_and_wait(TestGoal(goal), *timeouts)))
    )
    thread.start()
    return answers, thread


show("== send_goal_and_wait: in time")
answers, thread = goal_and_wait(3)
show(server.wait_goals(1))
server.result(server.goals[-1].goal_id.id, S.SUCCEEDED, "ok", 3)
thread.join(30)
show(answers, client.get_result(), repr(client.get_goal_status_text()))

show("== send_goal_and_wait: preempted in time")
answers, thread = goal_and_wait(4, short, rospy.Duration(5))
show(server.wait_goals(2), server.wait_cancels(1))
server.result(server.goals[-1].goal_id.id, S.PREEMPTED, "stopped", 4)
thread.join(30)
show(answers, client.get_result(), repr(client.get_goal_status_text()))
story.tell()

show("== send_goal_and_wait: preempted, waits for ever")
answers, thread = goal_and_wait(5, short)
show(server.wait_goals(3), server.wait_cancels(2))
server.result(server.goals[-1].goal_id.id, S.SUCCEEDED, "done all the same", 5)
thread.join(30)
show(answers, client.get_result(), repr(client.get_goal_status_text()))
story.tell()

show("== send_goal_and_wait: never")
answers, thread = goal_and_wait(6, short, short)
show(server.wait_goals(4), server.wait_cancels(3))
thread.join(30)
show(answers, client.get_result(), repr(client.get_goal_status_text()))
story.tell()

show("== wait_for_result in several threads")
client.send_goal(TestGoal(7))
show(server.wait_goals(5))
answers = []
threads = [threading.Thread(target=lambda: answers.append(client.wait_for_result())) for _ in range(3)]
for thread in threads:
    thread.start()
server.result(server.goals[-1].goal_id.id, S.SUCCEEDED, "", 7)
for thread in threads:
    thread.join(30)
show(answers, client.wait_for_result(short))
story.tell()

show("== cancels")
client.cancel_all_goals()
show(server.wait_cancels(4), repr(server.cancels[-1].id), server.cancels[-1].stamp.to_sec())
client.cancel_goals_at_and_before_time(rospy.Time(12, 5))
show(server.wait_cancels(5), repr(server.cancels[-1].id), server.cancels[-1].stamp)
story.tell()

show("== wrong arguments")
outcome("no goal", lambda: client.send_goal())
outcome("a number of seconds", lambda: client.wait_for_result(0.01))
outcome("a number of seconds", lambda: client.wait_for_server(0.01))
outcome("a number of seconds", lambda: client.send_goal_and_wait(TestGoal(), 0.01))
outcome("no action", lambda: actionlib.SimpleActionClient("server", TestGoal))
outcome("no action", lambda: actionlib.SimpleActionServer("server", TestGoal, auto_start=False))
outcome("no action", lambda: actionlib.ActionClient("server", TestGoal))
outcome("no action", lambda: actionlib.ActionServer("server", TestGoal, None, None, False))
