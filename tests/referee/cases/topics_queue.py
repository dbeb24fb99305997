"""Queues: the messages of a slow callback for each queue_size, and no loss without a limit."""

import threading

import rospy
from referee import eventually, show
from std_msgs.msg import Int32, String


def slow(topic, count, **arguments):
    """Publish during the first callback, and print the messages after it."""
    publisher = rospy.Publisher(topic, Int32, queue_size=1000)
    got, begun, go_on, done = [], threading.Event(), threading.Event(), threading.Event()

    def callback(message):
        got.append(message.data)
        begun.set()
        go_on.wait(30)
        if message.data == count:
            done.set()

    subscriber = rospy.Subscriber(topic, Int32, callback, **arguments)
    eventually(lambda: publisher.get_num_connections() == 1)
    publisher.publish(0)
    begun.wait(30)
    for number in range(1, count + 1):
        publisher.publish(number)
    rospy.sleep(0.5)
    go_on.set()
    show(topic, arguments, done.wait(30), got[0], got[1:4], "...", got[-3:], len(got))
    subscriber.unregister()
    publisher.unregister()


rospy.init_node("case", argv=[])
slow("/newest", 100, queue_size=1)
slow("/newest_three", 100, queue_size=3)
slow("/all", 100)
slow("/all_by_a_large_queue", 100, queue_size=1000)
slow("/negative", 100, queue_size=-1)

for size in (None, 0, 1000):
    publisher = rospy.Publisher(f"/publisher_{size}", String, queue_size=size)
    got = []
    rospy.Subscriber(publisher.name, String, lambda message, got=got: got.append(message.data))
    eventually(lambda publisher=publisher: publisher.get_num_connections() == 1)
    for number in range(300):
        publisher.publish(str(number))
    show("publisher", size, eventually(lambda got=got: len(got) == 300), got == [str(n) for n in range(300)])

# A publisher in many threads: each thread's messages stay in order.
publisher = rospy.Publisher("/threads", Int32, queue_size=5000)
got = []
rospy.Subscriber("/threads", Int32, lambda message: got.append(message.data))
eventually(lambda: publisher.get_num_connections() == 1)
threads = [
    threading.Thread(target=lambda base=base: [publisher.publish(base + n) for n in range(200)])
    for base in range(0, 5000, 1000)
]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
show(
    "threads",
    eventually(lambda: len(got) == 1000),
    all(
        [n for n in got if n // 1000 == base] == sorted(n for n in got if n // 1000 == base)
        for base in range(5)
    ),
)
