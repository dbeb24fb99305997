"""Callbacks that raise a BaseException: the link stays open, and later messages are delivered."""

import threading

import rospy
from referee import show
from std_msgs.msg import Int32

rospy.init_node("case", argv=[])
arrived = threading.Condition()
seen = []
EXITS = {2: SystemExit, 3: GeneratorExit, 4: KeyboardInterrupt, 5: lambda: SystemExit(7)}


def callback(message):
    with arrived:
        seen.append(message.data)
        arrived.notify_all()
    if message.data in EXITS:
        raise EXITS[message.data]()


publisher = rospy.Publisher("/chatter", Int32, queue_size=10)
subscriber = rospy.Subscriber("/chatter", Int32, callback)
while not publisher.get_num_connections():
    rospy.sleep(0.01)
for number in range(1, 8):
    publisher.publish(number)
    with arrived:
        arrived.wait_for(lambda number=number: number in seen, 60)
show("seen", seen)
show("links", subscriber.get_num_connections(), publisher.get_num_connections())
