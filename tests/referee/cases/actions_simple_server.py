"""SimpleActionServer with an execute callback: success, preemption by goal and by cancel, callbacks that set no result."""

import threading

import actionlib
import rospy
from action_peer import RawClient, Story, name_of
from actionlib.msg import TestAction, TestFeedback, TestResult
from actionlib_msgs.msg import GoalStatus
from referee import eventually, show

rospy.init_node("case", argv=[], disable_rosout=True)
rospy.set_param("server/status_list_timeout", 100.0)
story = Story()
go_on = threading.Semaphore(0)


def execute(goal):
    status = server.current_goal.get_goal_status()
    story.say("execute", goal.goal, status.goal_id.id, name_of(status.status), server.is_active())
    if goal.goal == 1:
        server.publish_feedback(TestFeedback(11))
        server.publish_feedback(TestFeedback(12))
        server.set_succeeded(TestResult(goal.goal), "fine")
    elif goal.goal == 2:
        server.set_aborted()
    elif goal.goal == 3:
        raise ValueError("what the callback raises")
    elif goal.goal == 4:
        pass
    elif goal.goal == 5:
        go_on.acquire()
        story.say(
            "asked to stop:", server.is_preempt_requested(), "new goal:", server.is_new_goal_available()
        )
        if server.is_preempt_requested():
            server.set_preempted(TestResult(55), "stopped")
        else:
            server.set_succeeded()
    elif goal.goal == 6:
        go_on.acquire()
        server.set_succeeded(TestResult(6))
        server.set_succeeded(TestResult(7))
    story.say("executed", goal.goal, server.is_active(), server.is_preempt_requested())


server = actionlib.SimpleActionServer("server", TestAction, execute, False)
server.start()
client = RawClient("server", hides_pending=True)


def send(id, goal, stamp=None):
    client.goal(id, goal, stamp and rospy.Time(stamp))


def tell():
    story.tell()
    client.tell()


show("== succeeds")
send("a", 1)
show(
    client.wait_status("a", GoalStatus.SUCCEEDED),
    client.wait_results(1),
    client.wait_feedback(2),
    story.wait(2),
)
tell()

show("== aborts")
send("b", 2)
show(client.wait_status("b", GoalStatus.ABORTED), client.wait_results(1), story.wait(2))
tell()

show("== raises")
send("c", 3)
show(client.wait_status("c", GoalStatus.ABORTED), client.wait_results(1))
tell()

show("== sets no terminal state")
send("d", 4)
show(client.wait_status("d", GoalStatus.ABORTED), client.wait_results(1))
tell()

show("== preempted by a cancel")
send("e", 5)
show(client.wait_status("e", GoalStatus.ACTIVE), story.wait(1))
client.cancel("e")
show(client.wait_status("e", GoalStatus.PREEMPTING), eventually(server.is_preempt_requested))
go_on.release()
show(client.wait_status("e", GoalStatus.PREEMPTED), client.wait_results(1), story.wait(3))
tell()

show("== preempted by a new goal")
send("f", 5)
show(client.wait_status("f", GoalStatus.ACTIVE), story.wait(1))
send("g", 1)
show(client.wait_status("g", GoalStatus.PENDING))
go_on.release()
show(
    client.wait_status("g", GoalStatus.SUCCEEDED),
    client.wait_results(2),
    client.wait_feedback(2),
    story.wait(5),
)
tell()

show("== preempted by a new goal which a newer one takes the place of")
send("h", 5)
show(client.wait_status("h", GoalStatus.ACTIVE), story.wait(1))
send("i", 1)
show(client.wait_status("i", GoalStatus.PENDING))
send("j", 2)
show(client.wait_status("j", GoalStatus.PENDING), client.wait_results(1))
go_on.release()
show(client.wait_status("j", GoalStatus.ABORTED), client.wait_results(3), story.wait(5))
tell()

show("== a waiting goal is canceled")
send("k", 5)
show(client.wait_status("k", GoalStatus.ACTIVE), story.wait(1))
send("l", 1)
show(client.wait_status("l", GoalStatus.PENDING))
client.cancel("l")
show(client.wait_status("l", GoalStatus.RECALLING), eventually(lambda: server.new_goal_preempt_request))
go_on.release()
show(
    client.wait_status("l", GoalStatus.SUCCEEDED),
    client.wait_results(2),
    client.wait_feedback(2),
    story.wait(5),
)
tell()

show("== the cancel of all reaches both")
send("m", 5)
show(client.wait_status("m", GoalStatus.ACTIVE), story.wait(1))
send("n", 5)
show(client.wait_status("n", GoalStatus.PENDING))
client.cancel()
show(client.wait_status("n", GoalStatus.RECALLING), client.wait_status("m", GoalStatus.PREEMPTING))
show(eventually(lambda: server.new_goal_preempt_request))
go_on.release()
show(client.wait_status("n", GoalStatus.PREEMPTING))
go_on.release()
show(client.wait_status("n", GoalStatus.PREEMPTED), client.wait_results(2), story.wait(6))
tell()

show("== a terminal state is set twice")
go_on.release()
send("o", 6)
show(client.wait_status("o", GoalStatus.SUCCEEDED), client.wait_results(1), story.wait(2))
tell()
rospy.signal_shutdown("the case is over")
