"""Mismatched types: nothing is received, the node continues, and a matching Subscriber gets its messages."""

import rospy
from referee import Other, eventually, show
from std_msgs.msg import Bool, String

OTHER = """
import sys, rospy
from std_msgs.msg import Bool
rospy.init_node("other", argv=[])
wrong = rospy.Publisher("/mismatched", Bool, queue_size=1, latch=True)
wrong.publish(True)
right = rospy.Publisher("/fitting", Bool, queue_size=1, latch=True)
right.publish(True)
print("ready", flush=True)
sys.stdin.readline()
print(wrong.get_num_connections(), right.get_num_connections(), flush=True)
sys.stdin.read()
"""

rospy.init_node("case", argv=[])
other = Other(OTHER)
show(other.read())
got, fitting = [], []
rospy.Subscriber("/mismatched", String, got.append)
rospy.Subscriber("/fitting", Bool, fitting.append)
show("what fits is received", eventually(lambda: len(fitting) == 1), fitting[0].data)
show("what does not is not", got)
other.process.stdin.write("\n")
other.process.stdin.flush()
show("the publisher's links", other.read())
show(
    "both are registered",
    sorted(pair for pair in rospy.get_published_topics() if "tt" in pair[0] or "mis" in pair[0]),
)
show("it leaves", other.close())
