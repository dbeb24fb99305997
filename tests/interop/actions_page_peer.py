"""The action server /count on rospy or minirospy. Each line on stdin lets the running goal take one step."""

import queue
import sys
import threading

import actionlib
import rospy
from actionlib.msg import TestAction, TestFeedback, TestResult

steps = queue.Queue()


def read():
    for _ in sys.stdin:
        steps.put(None)
    rospy.signal_shutdown("the input has ended")


def execute(goal):
    # The client may not be connected to all of the topics yet.
    ends = (server.action_server.feedback_pub, server.action_server.result_pub)
    while not (all(end.get_num_connections() for end in ends) or rospy.is_shutdown()):
        rospy.sleep(0.02)
    for count in range(goal.goal + 1):
        server.publish_feedback(TestFeedback(count))
        while count < goal.goal:
            if server.is_preempt_requested() or rospy.is_shutdown():
                server.set_preempted(TestResult(count))
                return
            try:
                steps.get(timeout=0.05)
                break
            except queue.Empty:
                pass
    server.set_succeeded(TestResult(goal.goal * 100), "well <done>")


rospy.init_node("counter")
threading.Thread(target=read, daemon=True).start()
server = actionlib.SimpleActionServer("/count", TestAction, execute, False)
server.start()
print("ready", flush=True)
rospy.spin()
