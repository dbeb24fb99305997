"""wait_for_server: all five topics must be connected; messages that arrive meanwhile; a server that leaves."""

import threading
import time

import actionlib
import rospy
from actionlib.msg import TestAction, TestActionFeedback, TestActionGoal, TestActionResult
from actionlib_msgs.msg import GoalID, GoalStatusArray
from referee import Other, eventually, of_ten_looks, show

rospy.init_node("case", argv=[], disable_rosout=True)
client = actionlib.SimpleActionClient("server", TestAction)
second = actionlib.SimpleActionClient("server", TestAction)


def found(seconds=0.3):
    return client.wait_for_server(rospy.Duration.from_sec(seconds))


show("nothing", found())
status = rospy.Publisher("server/status", GoalStatusArray, latch=True, queue_size=5)
show("advertised", found())
status.publish(GoalStatusArray())
show("status", found())
goal = rospy.Subscriber("server/goal", TestActionGoal)
show("and goal", found())
cancel = rospy.Subscriber("server/cancel", GoalID)
show("and cancel", found())
feedback = rospy.Publisher("server/feedback", TestActionFeedback, queue_size=1)
show("and feedback", found())
result = rospy.Publisher("server/result", TestActionResult, queue_size=1)
show("and result", found(30))
show("the other client", second.wait_for_server(rospy.Duration(30)))
result.unregister()
show(
    "without result again",
    eventually(lambda: not client.action_client.result_sub.get_num_connections()),
    found(),
)
for end in (status, goal, cancel, feedback):
    end.unregister()

answers = []
other_client = actionlib.SimpleActionClient("other", TestAction)
threads = [
    threading.Thread(target=lambda: answers.append(other_client.wait_for_server(rospy.Duration(30))))
    for _ in range(3)
]
for thread in threads:
    thread.start()
SERVER = """
import sys, actionlib, rospy
from actionlib.msg import TestAction
rospy.init_node("server", argv=[])
server = actionlib.SimpleActionServer("other", TestAction, lambda goal: server.set_succeeded(), False)
server.start()
print("ready", flush=True)
sys.stdin.read()
rospy.signal_shutdown("")
"""
server = Other(SERVER)
show("server is", server.read())
for thread in threads:
    thread.join(30)
show("three that waited", answers)


def at_once():
    before = time.monotonic()
    return other_client.wait_for_server(), time.monotonic() - before < 0.5


show("at once", *of_ten_looks(at_once))
server.close()
show("gone", eventually(lambda: not other_client.action_client.pub_goal.get_num_connections()))
show("without it", other_client.wait_for_server(rospy.Duration.from_sec(0.3)))
server = Other(SERVER)
show("server is", server.read())
show("back", other_client.wait_for_server(rospy.Duration(30)))
server.close()

stopped = []
waiting = threading.Thread(target=lambda: stopped.append(client.wait_for_server()))
waiting.start()
rospy.signal_shutdown("the case is over")
waiting.join(60)
show("a shutdown ends it", stopped)
