"""Programs' uses of the `impl` of a Publisher and a Subscriber, such as rosbridge's and Jupyter widgets'."""

import logging
import os
import re

import rospy
from referee import eventually, outcome, show
from std_msgs.msg import Int32, String

# For minirospy: use only ROS 1's transport.
os.environ["MINIROSPY_TRANSPORT"] = "tcp"
rospy.init_node("case", argv=[], disable_rosout=True)
got = []


def take(message, *args):
    got.append((message.data, *args))


def taken(*expected):
    """Return whether exactly these messages have arrived; discard them."""
    came = eventually(lambda: len(got) >= len(expected)) and sorted(got, key=str) == list(expected)
    found, got[:] = list(got), []
    return came or found


publisher = rospy.Publisher("c", Int32, queue_size=5, latch=True)
subscriber = rospy.Subscriber("c", Int32, take, "own")
show(publisher.impl.is_latch, publisher.impl.subscriber_listeners)
publisher.publish(1)
show(taken((1, "own")))
show(subscriber.impl.add_callback(take, ["more"]), taken((1, ["more"])))
publisher.publish(2)
show(taken((2, "own"), (2, ["more"])))
show(subscriber.impl.remove_callback(take, ["more"]))
publisher.publish(3)
show(taken((3, "own")))
outcome("again", lambda: subscriber.impl.remove_callback(take, ["more"]))
outcome("another", lambda: subscriber.impl.remove_callback(print, None))
subscriber.impl.add_callback(take, None)
show(taken((3,)))
publisher.publish(4)
show(taken((4, "own"), (4,)))


class Listener(rospy.SubscribeListener):
    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        heard.append(("has come", topic_name))

    def peer_unsubscribe(self, topic_name, num_peers):
        heard.append(("has gone", topic_name, num_peers))


def show_heard():
    """Print the listener's messages, in a separate thread."""
    eventually(lambda: heard)
    show(*heard.pop())


heard = []
listener = Listener()
show(publisher.impl.add_subscriber_listener(listener), publisher.impl.subscriber_listeners == [listener])
subscriber.unregister()
show_heard()
show(eventually(lambda: not publisher.impl.has_connections()))
subscriber = rospy.Subscriber("c", Int32, take)
show_heard()
show(taken((4,)))
publisher.impl.subscriber_listeners.remove(listener)
subscriber.unregister()
show(eventually(lambda: not publisher.impl.has_connections()))

# A topic that stops latching, and starts again.
publisher.impl.is_latch = False
subscriber = rospy.Subscriber("c", Int32, take)
show(eventually(lambda: publisher.impl.has_connection("/case")))
publisher.publish(5)
show(taken((5,)))
publisher.impl.is_latch = True
publisher.publish(6)
show(taken((6,)))
subscriber.unregister()
show(eventually(lambda: not publisher.impl.has_connections()))
subscriber = rospy.Subscriber("c", Int32, take)
show(taken((6,)))
show(subscriber.impl.set_queue_size(1), subscriber.impl.set_buff_size(100))
other = rospy.Publisher("d", Int32, queue_size=5)
show(other.impl.is_latch, other.impl.enable_latch(), other.impl.is_latch)

# The attributes of a connection that programs read.
met = rospy.Publisher("/met", Int32, queue_size=1, latch=True)
seen = []
meeting = rospy.Subscriber("/met", Int32, seen.append)
met.publish(1)
show(eventually(lambda: seen and met.impl.connections and meeting.impl.connections))
for topic in (met, meeting):
    (connection,) = topic.impl.connections
    show(
        type(topic.impl.connections).__name__, connection.direction, connection.name, connection.callerid_pub
    )
    show(connection.endpoint_id in (rospy.get_name(), rospy.get_node_uri()), isinstance(connection.id, int))
    show(connection.type, connection.md5sum, connection.is_latched, connection.done, connection.stat_num_msg)
    show(sorted(connection.header) if connection.header else None)

# Statistics, as in getBusStats and getBusInfo. The real one may not know the socket of the subscriber's endpoint.
counted = rospy.Publisher("/counted", String, queue_size=5)
readers = rospy.Subscriber("/counted", String, seen.append)
show(eventually(lambda: counted.impl.connections and readers.impl.connections))
del seen[:]
for number in range(3):
    counted.publish(str(number))
    show(eventually(lambda: len(seen) == number + 1))
name, sent, (row,) = counted.impl.get_stats()
show(name, sent, row[1:], type(row).__name__)
name, (row,) = readers.impl.get_stats()
show(name, row[1:], type(row).__name__)
for topic in (counted, readers):
    (row,) = topic.impl.get_stats_info()
    (connection,) = topic.impl.connections
    text = connection.get_transport_info()
    show(
        row[1:6],
        row[6] == text,
        row[0] == connection.id,
        re.sub(r"\d+|None", "N", text).replace("localhost", "N.N.N.N"),
    )


# Settings shared by a topic's handles, and the number of handles.
def show_published(topic):
    show(topic.queue_size, topic.headers, topic.ref_count, topic.closed, topic.is_latch)


def show_subscribed(topic):
    functions = [(function.__name__, args) for function, args in topic.callbacks]
    show(topic.queue_size, topic.buff_size, topic.tcp_nodelay, topic.ref_count, topic.closed, functions)


handles = [rospy.Publisher("/together", String, queue_size=3)]
shared = handles[0].impl
show_published(shared)
for options in (
    {"queue_size": 7, "headers": {"x": "1"}},
    {"queue_size": 2, "latch": True, "headers": {"y": "1"}},
    {},
):
    handles.append(rospy.Publisher("/together", String, **options))
    show_published(shared)
for handle in handles:
    handle.unregister()
    show(shared.ref_count, shared.closed)
handles = [rospy.Subscriber("/together", String)]
shared = handles[0].impl
show_subscribed(shared)
for arguments, options in (
    ((take,), {"queue_size": 4}),
    ((take, 3), {"queue_size": 2, "tcp_nodelay": True, "buff_size": 100}),
    ((take,), {}),
):
    handles.append(rospy.Subscriber("/together", String, *arguments, **options))
    show_subscribed(shared)
shared.set_queue_size(9)
shared.set_buff_size(50)
shared.add_callback(take, 5)
show_subscribed(shared)
for handle in handles[::-1]:
    handle.unregister()
    show(shared.ref_count, shared.closed)

# Names that the master refuses: a line is logged, and the program continues.


class Lines(logging.Handler):
    def emit(self, record):
        show(record.levelname, record.getMessage())


logging.getLogger("rosout").addHandler(Lines())
for name in ("/", "a b"):
    rospy.Publisher(name, String, queue_size=1)
    rospy.Subscriber(name, String)
