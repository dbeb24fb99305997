"""Print the behaviour of topic_tools' programs, minirospy's or the real ones.

``sys.argv[1]`` is their folder, the rest starts one.
"""

import queue
import re
import subprocess
import sys
import threading
import time

import rosgraph
import roslib.message
import rospy
import rostopic
from geometry_msgs.msg import PointStamped
from std_msgs.msg import String
from topic_tools.srv import (
    DemuxAdd,
    DemuxDelete,
    DemuxList,
    DemuxSelect,
    MuxAdd,
    MuxDelete,
    MuxList,
    MuxSelect,
)

FOLDER, *STARTER = sys.argv[1:]
SECONDS = 100  # seconds after which a program is considered hung
rospy.init_node("drive", argv=[])


def say(*words):
    print(*words, flush=True)


def wait_for(condition):
    waiting = threading.Event()
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        if condition():
            return True
        waiting.wait(0.02)
    say("waited too long")
    return False


class Program:
    def __init__(self, name, *words):
        command = [*STARTER, f"{FOLDER}/{name}", *words]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.communicate()


class Heard:
    """The messages of a topic, in order, as (text, latched)."""

    def __init__(self, topic):
        self.messages = queue.Queue()
        self.last = None
        self.subscriber = rospy.Subscriber(topic, String, self.messages.put)
        wait_for(self.subscriber.get_num_connections)

    def next(self, after=""):
        """Return the next message; roscpp may send a latched one twice to a new subscriber."""
        message = self.messages.get(timeout=SECONDS)
        while message.data == after:
            message = self.messages.get(timeout=SECONDS)
        return (
            message.data,
            message._connection_header["type"],
            message._connection_header.get("latching", "0"),
        )

    def changes(self, count):
        """Return the strings of a latched topic without repetitions."""
        found = []
        while len(found) < count:
            text = self.messages.get(timeout=SECONDS).data
            if text != self.last:
                found.append(text)
            self.last = text
        return found

    def texts(self, count):
        return [self.messages.get(timeout=SECONDS).data for _ in range(count)]


def text(number):
    return f"{number} ".ljust(36, "x")


def connected(topic, latch=True, cls=String):
    """Return a publisher of a topic with one connected subscriber."""
    publisher = rospy.Publisher(topic, cls, queue_size=50, latch=latch)
    wait_for(publisher.get_num_connections)
    return publisher


def publish_until_heard(publisher, words, heard):
    """Publish a text until a message arrives: a relay may not know its subscriber yet, although that is connected."""
    wait_for(lambda: publisher.publish(words) or not heard.messages.empty())


for latch in (True, False):
    with Program("relay", f"/in_{latch}"):
        publisher = connected(f"/in_{latch}", latch)
        publisher.publish("first")
        heard = Heard(f"/in_{latch}_relay")
        if latch:
            say("relay", heard.next())
        publish_until_heard(publisher, "second", heard)
        say("relay", heard.next("first"), rostopic.get_topic_type(f"/in_{latch}_relay")[0])

master = rosgraph.Master("/drive")


def readers(topic):
    """Return the number of nodes that subscribe to a topic."""
    return sum(len(names) for name, names in master.getSystemState()[1] if name == topic)


for kind, parameters in (
    ("lazy", ["_lazy:=true"]),
    ("unreliable", ["_lazy:=true", "_unreliable:=true"]),
    ("stealth", ["_stealth:=true", "_monitor_topic:=/watched", "_monitor_rate:=0.2"]),
):
    source, target = f"/{kind}", f"/{kind}_relay"
    with Program("relay", source, target, *parameters):
        publisher = connected(source, False)
        publisher.publish("advertises the output")
        say(kind, "leaves", wait_for(lambda source=source: not readers(source)))
        heard = Heard(target) if kind != "stealth" else rospy.Subscriber("/watched", String, print)
        say(kind, "comes back", wait_for(lambda source=source: readers(source)))
        if kind != "stealth":
            # The old connection may still be counted, and the new one may not be there yet.
            wait_for(
                lambda publisher=publisher, heard=heard: publisher.publish("second") or heard.messages.qsize()
            )
            say(kind, heard.next()[0])
            heard.subscriber.unregister()
        else:
            heard.unregister()
        for number in range(3):
            publisher.publish(str(number))
        say(
            kind,
            "leaves again",
            wait_for(
                lambda source=source, publisher=publisher: publisher.publish("x") or not readers(source)
            ),
        )

with Program("relay", "points", "/points_out"):
    publisher = connected("points", True, PointStamped)
    message = PointStamped()
    message.header.stamp, message.header.frame_id, message.point.z = rospy.Time(5, 6), "a", 7.5
    publisher.publish(message)
    found = rospy.wait_for_message("/points_out", PointStamped, SECONDS)
    say("relay", found.header.stamp.to_nsec(), found.header.frame_id, found.point.z)

with Program("drop", "/d", "1", "3"):
    publisher = connected("/d", latch=False)
    publisher.publish("0")
    heard = Heard("/d_drop")
    for number in range(1, 9):
        publisher.publish(str(number))
    say("drop", heard.texts(6))

with Program("throttle", "messages", "/t", "0.001", "/slow"):
    publisher = connected("/t")
    for number in range(5):
        publisher.publish(text(number))
    heard = Heard("/slow")
    say("throttle", heard.texts(1))

with Program("throttle", "bytes", "/b", "100", "1000"):
    publisher = connected("/b")
    publisher.publish(text(1))
    heard = Heard("/b_throttle")
    found = heard.texts(1)
    for number in range(2, 9):
        publisher.publish(text(number))
    while found[-1] != text(3):
        found += heard.texts(1)
    say("throttle", [each.split()[0] for each in dict.fromkeys(found)], heard.messages.qsize())

points = rospy.Publisher("/stamped", PointStamped, queue_size=5, latch=True)
message = PointStamped()
message.header.frame_id, message.point.x, message.point.y = "map", 3, 4
timer = rospy.Timer(rospy.Duration(0.1), lambda event: points.publish(message))
for words in (
    ("transform", "/stamped/point", "/length", "std_msgs/Float64", "numpy.sqrt(m.x**2 + m.y**2)"),
    (
        "transform",
        "/stamped",
        "/frame",
        "std_msgs/String",
        "m.header.frame_id + str(math.floor(m.point.y))",
        "-i",
        "math",
    ),
    ("transform", "/stamped/point/x", "/vector", "geometry_msgs/Vector3", "[m, m + 1, -m]"),
    (
        "relay_field",
        "/stamped/point",
        "/placed",
        "geometry_msgs/PoseStamped",
        "{header: {frame_id: odom}, pose: {position: {x: m.x, y: -m.y}}}",
    ),
    (
        "relay_field",
        "/stamped",
        "/named",
        "std_msgs/Header",
        "{stamp: {secs: int(m.point.x)}, frame_id: m.header.frame_id}",
    ),
):
    with Program(*words):
        found = rospy.wait_for_message(words[2], roslib.message.get_message_class(words[3]), SECONDS)
        say(words[0], re.sub(r"seq: \d+ ", "", " ".join(str(found).split())))

timer.shutdown()

with Program("mux", "/chosen", "/left", "/right"):
    select, add, delete, names = (
        rospy.ServiceProxy(f"/mux/{name}", cls)
        for name, cls in (("select", MuxSelect), ("add", MuxAdd), ("delete", MuxDelete), ("list", MuxList))
    )
    names.wait_for_service(SECONDS)

    def attempt(call, *arguments):
        try:
            return str(call(*arguments)).strip() or "done"
        except rospy.ServiceException:
            return "refused"

    selected = Heard("/mux/selected")
    say("mux", selected.changes(1), names().topics)
    left, right = connected("/left", False), connected("/right", False)
    right.publish("advertise")
    heard = Heard("/chosen")
    for choice in ("/right", "right", "__none", "/left", "/nothing"):
        say("mux select", choice, attempt(select, choice))
    say("mux", selected.changes(4))
    right.publish("not this")
    left.publish("from the left")
    say("mux", heard.texts(1))
    for call in (
        (add, "third"),
        (add, "/third"),
        (add, "__none"),
        (delete, "/left"),
        (delete, "/right"),
        (delete, "/right"),
    ):
        say("mux", call[0].resolved_name, call[1], attempt(*call))
    say("mux", names().topics)
    say("mux", attempt(rospy.ServiceProxy("/chosen_select", MuxSelect), "/third"))
    third = connected("/third", False)
    third.publish("from the third")
    say("mux", heard.texts(1))

with Program("demux", "/apart", "/one", "/two"):
    select, add, delete, names = (
        rospy.ServiceProxy(f"/demux/{name}", cls)
        for name, cls in (
            ("select", DemuxSelect),
            ("add", DemuxAdd),
            ("delete", DemuxDelete),
            ("list", DemuxList),
        )
    )
    names.wait_for_service(SECONDS)
    source = connected("/apart", False)
    heard = {}
    for topic in ("/one", "/two"):
        heard[topic] = queue.Queue()
        rospy.Subscriber(topic, String, heard[topic].put)
    selected = Heard("/demux/selected")
    say("demux", selected.changes(1), sorted(names().topics))
    # It advertises an output with the first message, and does not wait until subscribers have connected.
    wait_for(lambda: source.publish("a") or heard["/one"].qsize())
    message = heard["/one"].get(timeout=SECONDS)
    say("demux", message.data, message._connection_header.get("latching", "0"))
    for choice in ("two", "/nothing", "__none", "/two"):
        say("demux select", choice, attempt(select, choice))
    say("demux", selected.changes(3))
    wait_for(lambda: source.publish("b") or heard["/two"].qsize())
    message = heard["/two"].get(timeout=SECONDS)
    while message.data == "a":
        # The message that selects the other output has overtaken it.
        message = heard["/two"].get(timeout=SECONDS)
    say("demux", message.data, sum(each.data == "b" for each in heard["/one"].queue))
    for call in (
        (add, "third"),
        (add, "/third"),
        (add, "__none"),
        (delete, "/two"),
        (delete, "/one"),
        (delete, "/one"),
    ):
        say("demux", call[0].resolved_name, call[1], attempt(*call))
    say("demux", sorted(names().topics))

with Program("mux", "/out", "/a", "/b"):
    for words in (
        ("mux_list", "mux"),
        ("mux_select", "mux", "/b"),
        ("mux_add", "mux", "/c"),
        ("mux_delete", "mux", "/a"),
        ("mux_list", "mux"),
        ("mux_select", "mux"),
        ("mux_list",),
    ):
        done = subprocess.run(
            [*STARTER, f"{FOLDER}/{words[0]}", *words[1:]],
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
        )
        say(words, done.returncode, sorted(done.stdout.split("\n")))
