"""message_filters.Subscriber: a topic's messages, and the attributes of rospy.Subscriber."""

import threading

import message_filters
import rospy
from geometry_msgs.msg import PointStamped
from referee import eventually, outcome, show

rospy.init_node("filters")
done = threading.Event()
found = []

left = message_filters.Subscriber("left", PointStamped)
right = message_filters.Subscriber("/right", PointStamped, queue_size=5)
show(
    left.getTopic(),
    left.topic,
    left.name,
    left.resolved_name,
    left.type,
    left.data_class.__name__,
    left.get_num_connections(),
)
outcome("an attribute that rospy.Subscriber lacks", lambda: left.nothing)
outcome("a callback", lambda: message_filters.Subscriber("/right", PointStamped, callback=show).getTopic())
outcome("a callback by position", lambda: message_filters.Subscriber("/right", PointStamped, show))
outcome("a class that is none", lambda: message_filters.Subscriber("/right", "PointStamped"))

both = message_filters.TimeSynchronizer([left, right], 10)


def together(a, b, word):
    found.append((a.point.x, b.point.x, word))
    done.set()


both.registerCallback(together, "extra")
publishers = [rospy.Publisher(topic, PointStamped, queue_size=5) for topic in ("left", "right")]
eventually(lambda: all(publisher.get_num_connections() for publisher in publishers))
for number, publisher in enumerate(publishers):
    message = PointStamped()
    message.header.stamp = rospy.Time(7, 8)
    message.point.x = number + 1
    publisher.publish(message)
show(done.wait(20), found)
left.unregister()
show(left.sub.impl is None, right.impl is None)
