"""Latched topics: a late subscriber receives the last message; two Publishers of one topic."""

import threading

import rospy
from referee import Other, eventually, show
from std_msgs.msg import String

LISTENER = """
import sys, rospy
from std_msgs.msg import String
rospy.init_node("listener", anonymous=True, argv=[])
def heard(message):
    header = message._connection_header
    print(message.data, header["latching"], header["topic"], header["type"], header["callerid"], flush=True)
print("ready", flush=True)
rospy.Subscriber(sys.argv[1], String, heard)
sys.stdin.read()
"""


def listener(topic):
    """Start a node that prints what it receives on a topic."""
    other = Other(LISTENER, topic)
    assert other.read() == "ready"
    return other


rospy.init_node("case", argv=[])
latched = rospy.Publisher("/latched", String, latch=True, queue_size=1)
latched.publish("one")
latched.publish("two")
first = listener("/latched")
show("late", first.read())
second = listener("/latched")
show("later", second.read())
show(eventually(lambda: latched.get_num_connections() == 2))
latched.publish("three")
show("both", first.read(), second.read())
first.close()
second.close()
show("gone", eventually(lambda: latched.get_num_connections() == 0))

plain = rospy.Publisher("/mixed", String, queue_size=1)
plain.publish("before")
mixed = rospy.Publisher("/mixed", String, latch=True, queue_size=1)
plain.publish("by the plain one")
third = listener("/mixed")
show("mixed", third.read())
third.close()
mixed.unregister()
plain.publish("latch handle is gone")
fourth = listener("/mixed")
show("the latch's Publisher is gone", fourth.read())
fourth.close()

latched.unregister()
anew = rospy.Publisher("/latched", String, latch=True, queue_size=1)
fifth = listener("/latched")
show("anew", eventually(lambda: anew.get_num_connections() == 1))
anew.publish("anew")
show(fifth.read())
fifth.close()

got = []
arrived = threading.Event()
here = rospy.Publisher("/here", String, latch=True, queue_size=1)
here.publish("in one node")
rospy.Subscriber("/here", String, lambda message: (got.append(message.data), arrived.set()))
show(arrived.wait(60), got)

p = rospy.Publisher("/shared", String, latch=True, queue_size=1)
p.publish("kept")
heard, more = [], []
one = rospy.Subscriber("/shared", String, heard.append)
show(eventually(lambda: len(heard) == 1))
two = rospy.Subscriber("/shared", String, lambda message, mark: more.append((message.data, mark)), "mark")
show("at once, in the constructor", more)
show("the message of a connection that is there", rospy.wait_for_message("/shared", String, 10).data)
show("nobody else got it again", len(heard), len(more))
