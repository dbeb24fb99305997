"""SubscribeListener: which listeners are notified of subscribers that join and leave, and the two publish functions."""

import threading

import rospy
from referee import Other, eventually, outcome, show
from std_msgs.msg import String

LISTENER = """
import sys, rospy
from std_msgs.msg import String
rospy.init_node("listener", anonymous=True, argv=[])
rospy.Subscriber(sys.argv[1], String, lambda message: print(message.data, flush=True))
sys.stdin.read()
"""

rospy.init_node("case", argv=[])
notified = []
changed = threading.Condition()


def tell(*what):
    with changed:
        notified.append(what)
        changed.notify_all()


def wait(count):
    with changed:
        return changed.wait_for(lambda: len(notified) >= count, 60)


class Listener(rospy.SubscribeListener):
    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        peer_publish(String("welcome, peer"))
        tell("come", topic_name)

    def peer_unsubscribe(self, topic_name, num_peers):
        tell("gone", topic_name, num_peers)


publisher = rospy.Publisher("/topic", String, Listener(), queue_size=10)
first = Other(LISTENER, "/topic")
wait(1)
show(notified, publisher.get_num_connections())
show("first", first.read())
second = Other(LISTENER, "/topic")
wait(2)
show(notified, publisher.get_num_connections())
show("second", second.read())
publisher.publish("for all")
show(first.read(), second.read())
first.close()
wait(3)
show(notified[2:], publisher.get_num_connections())

other = rospy.Publisher("/topic", String, Listener(), queue_size=10)
third = Other(LISTENER, "/topic")
wait(5)
show("two listeners", notified[3:])
show(third.read(), third.read())
other.unregister()
second.close()
wait(6)
show("one Publisher is gone", len(notified) >= 6, notified[5])
third.close()
del notified[:]
show("nobody", eventually(lambda: publisher.get_num_connections() == 0))


class Whole(rospy.SubscribeListener):
    """Uses the other function, and does not notify peers that leave."""

    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        topic_publish(String("welcome, all"))


rospy.Publisher("/whole", String, Whole(), queue_size=10)
fourth = Other(LISTENER, "/whole")
show("fourth", fourth.read())
fourth.close()


class Bad(rospy.SubscribeListener):
    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        tell("bad")
        raise ValueError("bad listener")


outcome("what a listener is", lambda: rospy.Publisher("/nobody", String, 5, queue_size=10).name)
base = rospy.SubscribeListener()
outcome("the base class", lambda: base.peer_subscribe("/t", print, print))
outcome("the base class", lambda: base.peer_unsubscribe("/t", 0))
