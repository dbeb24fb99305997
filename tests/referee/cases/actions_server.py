"""ActionServer: its callbacks and its messages for each goal, with a scripted client."""

import actionlib
import rospy
from action_peer import RawClient, Story, name_of
from actionlib.msg import TestAction, TestFeedback, TestResult
from actionlib_msgs.msg import GoalStatus
from referee import show

rospy.init_node("case", argv=[], disable_rosout=True)
rospy.set_param("server/status_list_timeout", 100.0)
story = Story()
handles = {}


def on_goal(handle):
    handles[handle.get_goal_id().id] = handle
    story.say(
        "goal callback",
        handle.get_goal_id().id,
        handle.get_goal().goal,
        name_of(handle.get_goal_status().status),
    )


def on_cancel(handle):
    story.say("cancel callback", handle.get_goal_id().id, name_of(handle.get_goal_status().status))


server = actionlib.ActionServer("server", TestAction, on_goal, on_cancel, auto_start=False)
server.start()
client = RawClient("server")

show("== succeeds")
client.goal("a", 1)
show(client.wait_status("a", GoalStatus.PENDING))
handles["a"].set_accepted("taken")
show(client.wait_status("a", GoalStatus.ACTIVE))
handles["a"].publish_feedback(TestFeedback(5))
handles["a"].set_succeeded(TestResult(7), "well done")
show(client.wait_status("a", GoalStatus.SUCCEEDED), client.wait_results(1), client.wait_feedback(1))
story.tell()
client.tell()

show("== aborts, without a result")
client.goal("b", 2)
client.wait_status("b", GoalStatus.PENDING)
handles["b"].set_accepted()
handles["b"].set_aborted(text="no")
show(client.wait_status("b", GoalStatus.ABORTED), client.wait_results(1))
story.tell()
client.tell()

show("== rejected")
client.goal("c", 3)
client.wait_status("c", GoalStatus.PENDING)
handles["c"].set_rejected(TestResult(1), "not me")
show(client.wait_status("c", GoalStatus.REJECTED), client.wait_results(1))
story.tell()
client.tell()

show("== canceled while pending")
client.goal("d", 4)
client.wait_status("d", GoalStatus.PENDING)
client.cancel("d")
show(client.wait_status("d", GoalStatus.RECALLING), story.wait(2))
handles["d"].set_canceled(None, "recalled")
show(client.wait_status("d", GoalStatus.RECALLED), client.wait_results(1))
story.tell()
client.tell()

show("== canceled while active")
client.goal("e", 5)
client.wait_status("e", GoalStatus.PENDING)
handles["e"].set_accepted("go")
client.wait_status("e", GoalStatus.ACTIVE)
client.cancel("e")
show(client.wait_status("e", GoalStatus.PREEMPTING), story.wait(2))
handles["e"].set_canceled(TestResult(3))
show(client.wait_status("e", GoalStatus.PREEMPTED), client.wait_results(1))
story.tell()
client.tell()

show("== recalling, accepted all the same, succeeds")
client.goal("f", 6)
client.wait_status("f", GoalStatus.PENDING)
client.cancel("f")
show(client.wait_status("f", GoalStatus.RECALLING), story.wait(2))
handles["f"].set_accepted("still")
show(client.wait_status("f", GoalStatus.PREEMPTING))
handles["f"].set_succeeded()
show(client.wait_status("f", GoalStatus.SUCCEEDED), client.wait_results(1))
story.tell()
client.tell()

show("== transitions that are none")
handles["f"].set_accepted()
handles["f"].set_rejected()
handles["f"].set_canceled()
handles["f"].set_succeeded()
handles["f"].set_aborted()
client.cancel("f")
show(story.wait_log("Transisitoning"))
story.tell()

show("== the same id again")
client.goal("f", 7)
client.goal("last", 8)
show(client.wait_status("last", GoalStatus.PENDING))
story.tell()
client.tell()
