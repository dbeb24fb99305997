"""Disabled logging: without /rosout, and without the topics in its messages."""

import rospy
from referee import Other, show

PROGRAM = """
import rospy
from rosgraph_msgs.msg import Log
import threading
import sys
rospy.init_node("other", disable_rosout=len(sys.argv) > 1)
got, come = [], threading.Event()
rospy.Subscriber("/rosout", Log, lambda m: (got.append(m), come.set()))
for _ in range(20 if len(sys.argv) > 1 else 500):
    rospy.logdebug("said")
    rospy.logwarn_throttle_identical(100, "once")
    rospy.logfatal_once("fatal")
    rospy.loginfo("said")
    if come.wait(0.02):
        break
print("got", [m.topics for m in got[:1]], flush=True)
"""


def run(label, *arguments):
    other = Other(PROGRAM, *arguments)
    line = ""
    while not line.startswith("got"):
        line = other.read()
    show(label, line, other.close())


rospy.init_node("case", argv=[], disable_rosout=True)
run("usual")
run("without rosout", "off")
rospy.set_param("/rosout_disable_topics_generation", True)
run("without topics")
