"""ActionServer: cancel requests for all goals, by id, by time, and for goals that have not arrived yet."""

import actionlib
import rospy
from action_peer import RawClient, Story, name_of
from actionlib.msg import TestAction
from actionlib_msgs.msg import GoalStatus
from referee import eventually, show

rospy.init_node("case", argv=[], disable_rosout=True)
rospy.set_param("server/status_list_timeout", 100.0)
story = Story()
handles = {}


def on_goal(handle):
    handles[handle.get_goal_id().id] = handle
    story.say("goal callback", handle.get_goal_id().id, name_of(handle.get_goal_status().status))


def on_cancel(handle):
    story.say("cancel callback", handle.get_goal_id().id, name_of(handle.get_goal_status().status))


server = actionlib.ActionServer("server", TestAction, on_goal, on_cancel, False)
server.start()
client = RawClient("server")


def send(id, stamp=None):
    client.goal(id, stamp=stamp and rospy.Time(stamp))
    show(id, client.wait_status(id, GoalStatus.PENDING))


show("== all")
send("a")
send("b")
handles["b"].set_accepted()
client.wait_status("b", GoalStatus.ACTIVE)
client.cancel()
show(client.wait_status("a", GoalStatus.RECALLING), client.wait_status("b", GoalStatus.PREEMPTING))
show(story.wait(4), server.last_cancel.to_sec())
story.tell()
client.tell()

show("== by id")
send("c", 10)
send("d", 20)
client.cancel("c")
show(client.wait_status("c", GoalStatus.RECALLING), story.wait(3))
story.tell()
client.tell()

show("== by time: at it and before")
send("e", 25)
send("f", 30)
send("g", 31)
send("no stamp")
client.cancel(stamp=rospy.Time(30))
show(client.wait_status("f", GoalStatus.RECALLING), story.wait(7))
show(eventually(lambda: server.last_cancel.to_sec() == 30))
send("g2", 32)
story.tell()
client.tell()

show("== by id and time")
send("h", 40)
send("i", 41)
client.cancel("i", rospy.Time(40))
show(client.wait_status("i", GoalStatus.RECALLING), client.wait_status("h", GoalStatus.RECALLING))
show(story.wait(6), eventually(lambda: server.last_cancel.to_sec() == 40))
story.tell()
client.tell()

show("== a goal that comes after the time of the cancel")
client.goal("late", 1, rospy.Time(39))
show(client.wait_status("late", GoalStatus.RECALLED), client.wait_results(1))
client.goal("late equal", 1, rospy.Time(40))
show(client.wait_status("late equal", GoalStatus.RECALLED), client.wait_results(2))
send("in time", 41)
story.tell()
client.tell()

show("== an earlier cancel does not move the time back")
client.cancel("x", rospy.Time(5))
show(client.wait_status("x", GoalStatus.RECALLING))
show(server.last_cancel.to_sec())

show("== a goal whose cancel came first")
client.cancel("y")
show(client.wait_status("y", GoalStatus.RECALLING))
client.goal("y", 3)
show(client.wait_status("y", GoalStatus.RECALLED), client.wait_results(1))
story.tell()
client.tell()
client.goal("y", 3)
client.goal("end")
show(client.wait_status("end", GoalStatus.PENDING))
story.tell()
client.tell()
