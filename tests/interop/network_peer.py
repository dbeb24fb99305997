"""A node on one of two machines, on rospy or minirospy; the first argument selects its role.

robot    publish /beat ("subscribed" reports each connection), repeat /order on /heard, serve /flag and the action
         /count, until stdin is closed
laptop   use everything that the robot offers, print the results, and exit
listen   print "beat" when /beat arrives after a second of silence, until stdin is closed
"""

import os
import sys
import threading
import time

import actionlib
import rospy
from actionlib.msg import TestAction, TestGoal, TestResult
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool, SetBoolResponse

SECONDS = 150

if os.environ.get("TEST_KEEPALIVE"):
    # Detect a pulled cable after seconds instead of a minute.
    from minirospy.runtime.transport import sockets

    sockets.KEEPALIVE.update(dict.fromkeys(sockets.KEEPALIVE, 1))


def say(*words):
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


class Tell(rospy.SubscribeListener):
    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        say("subscribed")


def robot():
    beat = rospy.Publisher("/beat", Int32, Tell(), queue_size=1)
    heard = rospy.Publisher("/heard", String, queue_size=1, latch=True)
    rospy.Subscriber("/order", String, lambda order: heard.publish("heard " + order.data))
    rospy.Service("/flag", SetBool, lambda request: SetBoolResponse(request.data, "from afar"))
    rospy.set_param("/robot", {"wheels": 2, "name": "r2"})

    def count(goal):
        # A client of actionlib in Python ignores everything that arrives before send_goal() returns.
        while not rospy.get_param("/sent", False):
            time.sleep(0.05)
        server.set_succeeded(TestResult(goal.goal + 1))

    server = actionlib.SimpleActionServer("/count", TestAction, count, False)
    server.start()
    threading.Thread(target=tick, args=(beat,), daemon=True).start()
    say("ready")
    sys.stdin.read()


def tick(beat):
    number = 0
    while not rospy.is_shutdown():
        beat.publish(number)
        number += 1
        time.sleep(0.05)


def laptop():
    say("beat", rospy.wait_for_message("/beat", Int32, timeout=SECONDS).data >= 0)
    order = rospy.Publisher("/order", String, queue_size=1, latch=True)
    order.publish("forward")
    say(rospy.wait_for_message("/heard", String, timeout=SECONDS).data)
    rospy.wait_for_service("/flag", timeout=SECONDS)
    response = rospy.ServiceProxy("/flag", SetBool)(True)
    say("flag", response.success, response.message)
    rospy.set_param("/robot/wheels", 4)
    say("param", sorted(rospy.get_param("/robot").items()))
    client = actionlib.SimpleActionClient("/count", TestAction)
    if not client.wait_for_server(rospy.Duration(SECONDS)):
        sys.exit("no action server")
    client.send_goal(TestGoal(41))
    rospy.set_param("/sent", True)
    client.wait_for_result(rospy.Duration(SECONDS))
    say("count", client.get_result().result)


def listen():
    last = [0.0]

    def on_beat(_):
        now = time.monotonic()
        if now - last[0] > 1.0:
            say("beat")
        last[0] = now

    rospy.Subscriber("/beat", Int32, on_beat, queue_size=1)
    say("ready")
    sys.stdin.read()


if __name__ == "__main__":
    role = sys.argv[1]
    rospy.init_node(role)
    {"robot": robot, "laptop": laptop, "listen": listen}[role]()
    rospy.signal_shutdown("done")
