"""Servers that die or restart during a goal, clients that die: the effects on the other side."""

import actionlib
import rospy
from action_peer import RawClient, name_of
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus
from referee import Other, eventually, show

SERVER = """
import sys, actionlib, rospy
from actionlib.msg import TestAction, TestFeedback
rospy.init_node("server", argv=[])
def execute(goal):
    server.publish_feedback(TestFeedback(goal.goal))
    while goal.goal == 1 and not rospy.is_shutdown() and not server.is_preempt_requested():
        rospy.sleep(0.01)
    if server.is_preempt_requested():
        server.set_preempted(text="preempted")
    else:
        server.set_succeeded(text="succeeded")
server = actionlib.SimpleActionServer("server", TestAction, execute, False)
server.start()
print("ready", flush=True)
sys.stdin.read()
rospy.signal_shutdown("")
"""
CLIENT = """
import sys, actionlib, rospy
from actionlib.msg import TestAction, TestGoal
rospy.init_node("client", argv=[])
client = actionlib.SimpleActionClient("server", TestAction)
client.wait_for_server()
client.send_goal(TestGoal(1), feedback_cb=lambda feedback: print("feedback", flush=True))
sys.stdin.read()
rospy.signal_shutdown("")
"""

rospy.init_node("case", argv=[], disable_rosout=True)
client = actionlib.SimpleActionClient("server", TestAction)
done = []
server = Other(SERVER)
show(server.read(), client.wait_for_server(rospy.Duration(20)))


def send(goal):
    client.send_goal(TestGoal(goal), done_cb=lambda state, result: done.append((name_of(state), result)))
    return eventually(lambda: client.get_state() == GoalStatus.ACTIVE)


show("== killed in mid-goal")
show(send(1))
server.process.kill()
server.close()
show("waits on", client.wait_for_result(rospy.Duration.from_sec(0.5)), name_of(client.get_state()), done)
server = Other(SERVER)
show(server.read(), client.wait_for_result(rospy.Duration(20)), name_of(client.get_state()), done)

show("== the new server takes goals")
show(client.wait_for_server(rospy.Duration(20)))
show(name_of(client.send_goal_and_wait(TestGoal(2), rospy.Duration(20))), client.get_goal_status_text())

show("== shut down in mid-goal")
done.clear()
show(send(1))
server.close()
show("waits on", client.wait_for_result(rospy.Duration.from_sec(0.5)), done)
server = Other(SERVER)
show(server.read(), client.wait_for_result(rospy.Duration(20)), name_of(client.get_state()), done)

show("== a client dies: the server goes on")
raw = RawClient("server")
other = Other(CLIENT)
show(other.read())
other.process.kill()
other.close()
show(eventually(lambda: GoalStatus.ACTIVE in raw.statuses.values()))
show("a goal of another one preempts it", name_of(client.send_goal_and_wait(TestGoal(3), rospy.Duration(20))))
show(raw.wait_results(2), [(status, text) for _, status, text, _ in raw.results])
server.close()
