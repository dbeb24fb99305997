"""SimpleActionServer without an execute callback: goal and preempt callbacks, goals accepted explicitly."""

import actionlib
import rospy
from action_peer import RawClient, Story, name_of
from actionlib.msg import TestAction, TestResult
from actionlib_msgs.msg import GoalStatus
from referee import eventually, outcome, show

rospy.init_node("case", argv=[], disable_rosout=True)
rospy.set_param("server/status_list_timeout", 100.0)
story = Story()
server = actionlib.SimpleActionServer("server", TestAction, auto_start=False)


def state():
    show(
        "new goal",
        server.is_new_goal_available(),
        "active",
        server.is_active(),
        "preempt",
        server.is_preempt_requested(),
    )


def on_goal():
    story.say("goal callback", server.is_new_goal_available(), server.is_active())


def on_preempt():
    story.say("preempt callback", server.is_preempt_requested(), server.is_active())


state()
outcome("accept", lambda: server.accept_new_goal())
outcome("register", lambda: server.register_goal_callback(on_goal))
outcome("register", lambda: server.register_preempt_callback(on_preempt))
server.start()
client = RawClient("server", hides_pending=True)
story.tell()

show("== one goal")
client.goal("a", 1)
show(client.wait_status("a", GoalStatus.PENDING), story.wait(1))
state()
outcome("accept", lambda: server.accept_new_goal().goal)
state()
outcome("accept again", lambda: server.accept_new_goal())
show(client.wait_status("a", GoalStatus.ACTIVE))
client.cancel("a")
show(client.wait_status("a", GoalStatus.PREEMPTING), story.wait(2))
state()
server.set_preempted()
state()
show(client.wait_results(1), client.wait_status("a", GoalStatus.PREEMPTED))
story.tell()
client.tell()

show("== a goal comes while one is active")
client.goal("b", 2)
show(client.wait_status("b", GoalStatus.PENDING))
server.accept_new_goal()
client.goal("c", 3)
show(client.wait_status("c", GoalStatus.PENDING), story.wait(3))
state()
outcome("accept", lambda: server.accept_new_goal().goal)
state()
show(client.wait_status("b", GoalStatus.PREEMPTED), client.wait_results(1))
server.set_succeeded(TestResult(3), "c is done")
show(client.wait_results(2), client.wait_status("c", GoalStatus.SUCCEEDED))
state()
story.tell()
client.tell()

show("== canceled before it is accepted")
client.goal("d", 4)
show(client.wait_status("d", GoalStatus.PENDING))
client.cancel("d")
show(client.wait_status("d", GoalStatus.RECALLING), eventually(lambda: server.new_goal_preempt_request))
state()
outcome("accept", lambda: server.accept_new_goal().goal)
state()
server.set_preempted(TestResult(4), "as asked")
show(client.wait_results(1), client.wait_status("d", GoalStatus.PREEMPTED))
story.tell()
client.tell()

show("== terminal states of a goal that waits")
client.goal("e", 5)
show(client.wait_status("e", GoalStatus.PENDING))
server.set_succeeded()
show(name_of(server.next_goal.get_goal_status().status))
story.tell()
server.accept_new_goal()
server.set_aborted(TestResult(5), "e")
show(client.wait_results(1))
story.tell()
outcome("default result", server.get_default_result)

show("== callbacks that raise")


def bad():
    story.say("bad callback")
    raise RuntimeError("bad")


server.register_goal_callback(bad)
server.register_preempt_callback(bad)
client.goal("f", 6)
show(client.wait_status("f", GoalStatus.PENDING), story.wait(1))
server.accept_new_goal()
client.cancel("f")
show(client.wait_status("f", GoalStatus.PREEMPTING), story.wait(2), story.wait_log("RuntimeError"))
state()
server.register_goal_callback(None)
server.register_preempt_callback(None)
client.goal("g", 7)
show(client.wait_status("g", GoalStatus.PENDING))
state()
story.tell()
