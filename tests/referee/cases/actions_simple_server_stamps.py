"""SimpleActionServer: a goal older than the running, the waiting or the last one."""

import threading

import actionlib
import rospy
from action_peer import RawClient, Story
from actionlib.msg import TestAction
from actionlib_msgs.msg import GoalStatus
from referee import show

rospy.init_node("case", argv=[], disable_rosout=True)
rospy.set_param("server/status_list_timeout", 100.0)
story = Story()
go_on = threading.Semaphore(0)


def execute(goal):
    story.say("execute", goal.goal)
    go_on.acquire(timeout=20)
    story.say("executed", goal.goal)
    if server.is_preempt_requested():
        server.set_preempted(text="stopped")
    else:
        server.set_succeeded(text="done")


server = actionlib.SimpleActionServer("server", TestAction, execute, False)
server.start()
client = RawClient("server", hides_pending=True)


def send(id, goal, stamp):
    client.goal(id, goal, rospy.Time(stamp))


def tell():
    story.tell()
    client.tell()


show("== older than the one that runs")
send("a", 1, 200)
show(client.wait_status("a", GoalStatus.ACTIVE), story.wait(1))
send("b", 2, 199)
show(client.wait_results(1), client.wait_status("b", GoalStatus.RECALLED))
tell()

show("== of the same time as the one that runs")
send("c", 3, 200)
show(client.wait_status("c", GoalStatus.PENDING))
tell()

show("== newer than the one that waits")
send("d", 4, 300)
show(client.wait_status("d", GoalStatus.PENDING), client.wait_status("c", GoalStatus.RECALLED))
show(client.wait_results(1))
tell()

show("== older than the one that waits, newer than the one that runs")
send("e", 5, 250)
show(client.wait_results(1), client.wait_status("e", GoalStatus.RECALLED))
tell()

show("== of the same time as the one that waits")
send("f", 6, 300)
show(client.wait_status("f", GoalStatus.PENDING), client.wait_status("d", GoalStatus.RECALLED))
show(client.wait_results(1))
tell()
go_on.release()
show(client.wait_results(1), story.wait(2))
go_on.release()
show(client.wait_results(2), client.wait_status("f", GoalStatus.SUCCEEDED))
tell()

show("== older than the last one")
send("g", 7, 299)
show(client.wait_results(1), client.wait_status("g", GoalStatus.RECALLED))
tell()
rospy.signal_shutdown("the case is over")
