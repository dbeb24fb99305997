"""SimpleActionClient: its state and its callbacks, with a scripted server that publishes every status and result."""

import weakref

import actionlib
import rospy
from action_peer import RawServer, Story, name_of
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus
from referee import eventually, show

rospy.init_node("case", argv=[], disable_rosout=True)
story = Story()
client = actionlib.SimpleActionClient("server", TestAction)
server = RawServer("server")
show(server.connected())
S = GoalStatus


def done(state, result):
    story.say("done", name_of(state), result.result if result else result, name_of(client.get_state()))


def active():
    story.say("active", name_of(client.get_state()))


def feedback(message):
    story.say("feedback", message.feedback, name_of(client.get_state()))


def send(**callbacks):
    """Send a goal; return its id."""
    count = len(server.goals)
    client.send_goal(TestGoal(count), **callbacks)
    show(server.wait_goals(count + 1), server.goals[-1].goal.goal)
    return server.goals[-1].goal_id.id


def tell():
    story.tell()
    show(
        name_of(client.get_state()),
        client.simple_state,
        repr(client.get_goal_status_text()),
        client.get_result(),
    )


show("== pending, active, feedback, succeeded, result")
id = send(done_cb=done, active_cb=active, feedback_cb=feedback)
tell()
server.status((id, S.PENDING, "waits"))
show(story.wait_log("to PENDING"))
tell()
server.status((id, S.ACTIVE, "runs"))
show(story.wait(1))
tell()
server.feedback(id, 1)
server.feedback("other", 2)
server.feedback(id, 3)
show(story.wait(2))
tell()
server.status((id, S.SUCCEEDED, "ready"))
show(story.wait_log("to WAITING_FOR_RESULT"))
tell()
server.result(id, S.SUCCEEDED, "with result", 7)
show(story.wait(1), client.wait_for_result())
tell()
server.feedback(id, 4)
server.result(id, S.SUCCEEDED, "again", 8)
show(story.wait_log("already"))
tell()

show("== a result before any status")
id = send(done_cb=done, active_cb=active)
server.result(id, S.ABORTED, "at once", 9)
show(story.wait(2), client.wait_for_result())
tell()

for final in (S.PREEMPTED, S.REJECTED, S.RECALLED, S.LOST, S.ACTIVE):
    show("== a result at once:", name_of(final))
    id = send(done_cb=done, active_cb=active)
    server.result(id, final, "text", 9)
    show(client.wait_for_result(), story.wait_log("done"))
    tell()

show("== canceled while pending")
id = send(done_cb=done, active_cb=active)
server.status((id, S.PENDING, ""))
show(story.wait_log("to PENDING"))
client.cancel_goal()
show(server.wait_cancels(1), server.cancels[-1].id == id, server.cancels[-1].stamp.to_sec())
tell()
server.status((id, S.RECALLING, ""))
show(story.wait_log("to RECALLING"))
tell()
server.status((id, S.RECALLED, ""))
server.result(id, S.RECALLED, "")
show(client.wait_for_result(), story.wait(1))
tell()

show("== canceled while active")
id = send(done_cb=done, active_cb=active)
server.status((id, S.ACTIVE, ""))
show(story.wait(1))
client.cancel_goal()
show(server.wait_cancels(2))
server.status((id, S.PREEMPTING, ""))
show(story.wait_log("to PREEMPTING"))
tell()
server.result(id, S.PREEMPTED, "", 4)
show(client.wait_for_result(), story.wait(1))
tell()

show("== a recalled goal that ran all the same")
id = send(done_cb=done, active_cb=active)
server.status((id, S.RECALLING, ""))
show(story.wait_log("to RECALLING"))
server.status((id, S.PREEMPTING, ""))
show(story.wait_log("to PREEMPTING"), story.wait(1))
tell()
server.result(id, S.SUCCEEDED, "", 5)
show(client.wait_for_result(), story.wait(1))
tell()

show("== lost: no more in the list")
id = send(done_cb=done, active_cb=active)
server.status()
server.status((id, S.ACTIVE, "runs"))
show(story.wait(1))
server.status(("other", S.ACTIVE, ""))
show(client.wait_for_result(), story.wait(2))
tell()

show("== a status that cannot follow")
id = send(done_cb=done)
server.status((id, S.ACTIVE, ""))
show(story.wait_log("to ACTIVE"))
server.status((id, S.RECALLED, ""))
show(story.wait_log("Invalid"))
tell()

show("== a new goal while one is tracked: the first is heard of no more")
# It exists for as long as the thread that logged the last line refers to it.
first = weakref.ref(client.gh.comm_state_machine)
second = send(done_cb=done)
show(eventually(lambda: first() is None))
server.result(id, S.SUCCEEDED, "first")
server.result(second, S.SUCCEEDED, "second")
show(client.wait_for_result(), story.wait(1))
tell()

show("== no more tracked")
id = send(done_cb=done, feedback_cb=feedback)
client.stop_tracking_goal()
server.feedback(id, 1)
server.result(id, S.SUCCEEDED, "")
id = send(done_cb=done, feedback_cb=feedback)
server.feedback(id, 2)
show(story.wait(1))
client.stop_tracking_goal()
tell()

show("== callbacks that raise")


def bad(*values):
    story.say("bad")
    raise ValueError("bad callback")


id = send(done_cb=bad, active_cb=bad, feedback_cb=bad)
server.status((id, S.ACTIVE, ""))
show(story.wait(1), story.wait_log("_status_cb"))
story.tell()
server.feedback(id, 1)
show(story.wait(1), story.wait_log("_feedback_cb"))
story.tell()
server.result(id, S.SUCCEEDED, "")
show(story.wait(1), story.wait_log("_result_cb"))
story.tell()
show(name_of(client.get_state()))
