"""Messages with a header: which are numbered, and which values of the program stay."""

import threading

import rospy
from geometry_msgs.msg import PointStamped
from referee import eventually, outcome, show
from std_msgs.msg import Header

rospy.init_node("case", argv=[])
publisher = rospy.Publisher("/stamped", PointStamped, queue_size=10)
got = []
arrived = threading.Condition()


def take(message):
    with arrived:
        got.append(message)
        arrived.notify_all()


# Without a subscriber it is not counted.
publisher.publish(PointStamped())
rospy.Subscriber("/stamped", PointStamped, take)
show(eventually(lambda: publisher.get_num_connections() == 1))
for sequence, frame in ((0, ""), (77, "map"), (0, "/odom")):
    message = PointStamped()
    message.header.seq, message.header.frame_id = sequence, frame
    publisher.publish(message)
    show("the program's message", message.header.seq, repr(message.header.frame_id), message.header.stamp)
other = rospy.Publisher("/stamped", PointStamped, queue_size=10)
other.publish(PointStamped())
publisher.publish(header=Header(seq=5, frame_id="by keyword"))
with arrived:
    arrived.wait_for(lambda: len(got) >= 5, 10)
show([(message.header.seq, message.header.frame_id) for message in got])


def unnamed():
    message = PointStamped()
    message.header.frame_id = None
    publisher.publish(message)
    with arrived:
        arrived.wait_for(lambda: len(got) >= 6, 10)
    return got[-1].header.frame_id


outcome("no frame", unnamed)

plain = rospy.Publisher("/header", Header, queue_size=10)
headers = []
rospy.Subscriber("/header", Header, headers.append)
show(eventually(lambda: plain.get_num_connections() == 1))
plain.publish(Header(seq=9))
show("a bare Header", eventually(lambda: len(headers) == 1), headers[0].seq)


def wrong():
    message = PointStamped()
    message.point.x = "far"
    publisher.publish(message)


def kind(call):
    """Return the type of what a call raises; the texts are those of Python's struct module."""
    try:
        call()
    except Exception as error:  # noqa: BLE001
        return type(error).__name__
    return "nothing"


show("a value that does not fit raises", kind(wrong))
