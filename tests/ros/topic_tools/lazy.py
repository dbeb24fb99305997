"""A lazy node, and a subscriber that joins, leaves and joins again: prints the node's actions. Runs under any rospy."""

import threading

import rospy
from std_msgs.msg import String
from topic_tools import LazyTransport


class Relay(LazyTransport):
    """Forwards strings while another node subscribes to them."""

    def __init__(self):
        super().__init__()
        self.left = threading.Event()
        self.output = self.advertise("words_out", String, queue_size=1)

    def subscribe(self):
        print("subscribed", flush=True)
        self._input = rospy.Subscriber("words_in", String, self.output.publish)

    def unsubscribe(self):
        print("unsubscribed", flush=True)
        self._input.unregister()
        self.left.set()


rospy.init_node("lazy")
is_lazy = rospy.get_param("~lazy", True)
words = rospy.Publisher("words_in", String, queue_size=1, latch=True)
words.publish("word")
relay = Relay()

for _ in range(2):
    came = threading.Event()
    subscriber = rospy.Subscriber("words_out", String, lambda message, came=came: came.set())
    # Repeat: strings that are forwarded before this subscriber connects are lost.
    while not came.wait(0.2):
        words.publish("word")
    print("word", flush=True)
    subscriber.unregister()

    # ROS's publisher notices that a subscriber has left only when it writes to the subscriber.
    while is_lazy and not relay.left.wait(0.2):
        relay.output.publish("word")
    relay.left.clear()
rospy.signal_shutdown("done")
