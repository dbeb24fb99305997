"""client/topics beyond rospy: warnings, waiting for subscribers, freshness, and robustness.

tests/referee/cases/topics*.py compare the rest with rospy. Each test is a separate program, because a process has one node.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from minirospy.runtime.rpc.master_proxy import MasterProxy

BEGIN = """
import sys, threading, rospy
from std_msgs.msg import Bool, Int32, String
from sensor_msgs.msg import Image
from geometry_msgs.msg import PointStamped

def eventually(condition):
    waiting = threading.Event()
    for _ in range(3000):
        if condition():
            return True
        waiting.wait(0.01)
    return False
"""

Start = Callable[[str], "subprocess.Popen[str]"]


@pytest.fixture
def start(master: str) -> Iterator[Start]:
    """Return a function that starts a program; kill the programs after the test."""
    with ExitStack() as running:

        def run(code: str) -> subprocess.Popen[str]:
            program = subprocess.Popen(
                [sys.executable, "-c", BEGIN + code],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            running.callback(program.communicate)
            running.callback(program.kill)
            return program

        yield run


def finished(program: subprocess.Popen[str]) -> tuple[str, str]:
    """Return a program's stdout and stderr; assert that it exits by itself, with status 0."""
    output, errors = program.communicate(timeout=60)
    assert program.returncode == 0, errors
    return output, errors


def line(program: subprocess.Popen[str]) -> str:
    assert program.stdout
    return program.stdout.readline().rstrip("\n")


UNHEARD = """
rospy.init_node("talker")
publisher = rospy.Publisher("/t", Bool, queue_size=1, latch={latch})
publisher.publish(True)
publisher.publish(True)
"""


@pytest.mark.parametrize("latch", [False, True])
@pytest.mark.parametrize("subscriber", [False, True])
def test_a_first_message_without_subscriber_is_logged_once(
    start: Start, master: str, subscriber: bool, latch: bool
) -> None:
    if subscriber:
        proxy = MasterProxy(master, "/listener")
        proxy.register_subscriber("/t", "std_msgs/Bool", "http://127.0.0.1:1/")
        proxy.close()
    _, errors = finished(start(UNHEARD.format(latch=latch)))
    warning = "the first message on /t went to nobody: 1 known to the master, not connected yet"
    assert errors.count(warning) == (1 if subscriber and not latch else 0)
    assert errors.count("\n") == errors.count(warning)


def test_waiting_for_subscribers(start: Start) -> None:
    output, errors = finished(
        start("""
publisher = rospy.Publisher("/t", Int32, queue_size=1)
try:
    publisher.wait_for_subscribers()
except rospy.ROSException as error:
    print(error)
rospy.init_node("talker")
print(publisher.wait_for_subscribers(timeout=0.01), publisher.wait_for_subscribers(0))
got, arrived = [], threading.Event()
threading.Timer(0.1, lambda: rospy.Subscriber("/t", Int32, lambda m: (got.append(m.data), arrived.set()))).start()
print(publisher.wait_for_subscribers())
publisher.publish(5)
print(arrived.wait(30), got)
threading.Timer(0.1, rospy.signal_shutdown, ["test"]).start()
try:
    publisher.wait_for_subscribers(2)
except rospy.ROSInterruptException as error:
    print(error)
publisher.unregister()
try:
    publisher.wait_for_subscribers()
except rospy.ROSException as error:
    print(error)
""")
    )
    assert output.splitlines() == [
        "ROS node has not been initialized yet. Please call init_node() first",
        "False True",
        "True",
        "True [5]",
        "rospy shutdown",
        "wait_for_subscribers() on an unregistered() handle",
    ]
    assert errors == ""


def test_another_type_on_a_topic_of_this_process_is_logged(start: Start) -> None:
    _, errors = finished(
        start("""
rospy.init_node("talker")
kept = [rospy.Publisher("/t", type_, queue_size=1) for type_ in (String, String, rospy.AnyMsg, Int32)]
""")
    )
    assert errors.count("\n") == 1
    assert "topic [/t] is published as [std_msgs/String] by this process already" in errors
    assert "[std_msgs/Int32]" in errors


def test_bytes_that_do_not_fit_a_second_class_are_reported(start: Start) -> None:
    output, errors = finished(
        start("""
rospy.init_node("both")
publisher = rospy.Publisher("/t", Int32, queue_size=1)
got, strings = [], []
rospy.Subscriber("/t", Int32, got.append)
rospy.Subscriber("/t", String, strings.append)
publisher.wait_for_subscribers()
publisher.publish(5)
print(eventually(lambda: got), strings)
publisher.publish(6)
print(eventually(lambda: len(got) == 2))
""")
    )
    assert output == "True []\nTrue\n"
    assert "a message on /t from /both does not fit std_msgs/String" in errors


def test_a_value_that_does_not_fit_leaves_nothing_behind(start: Start) -> None:
    output, _ = finished(
        start("""
rospy.init_node("talker")
publisher = rospy.Publisher("/t", PointStamped, queue_size=10)
got = []
rospy.Subscriber("/t", PointStamped, got.append)
publisher.wait_for_subscribers()
wrong = PointStamped()
wrong.header.frame_id = "a frame that is written before the fault"
wrong.point.y = "far"
try:
    publisher.publish(wrong)
except rospy.ROSSerializationException:
    print("refused")
right = PointStamped()
right.point.y = 2.0
publisher.publish(right)
print(eventually(lambda: got), got[0].point.y, repr(got[0].header.frame_id))
""")
    )
    assert output == "refused\nTrue 2.0 ''\n"


def test_a_number_that_equals_the_size_of_the_next_field_loses_no_message(start: Start) -> None:
    """Both fields look like the length of a byte array and the array, of which only the message class knows better."""
    output, errors = finished(
        start("""
from genpy.dynamic import generate_dynamic
Table = generate_dynamic("p/Table", "uint32 size\\nfloat64[8192] values\\n")["p/Table"]
rospy.init_node("both")
publisher = rospy.Publisher("/t", Table, queue_size=10)
got = []
rospy.Subscriber("/t", Table, got.append)
publisher.wait_for_subscribers()
for size in (65536, 1):
    publisher.publish(size, range(8192))
print(eventually(lambda: len(got) == 2), [table.size for table in got], got[0].values[8191])
""")
    )
    assert (output, errors) == ("True [65536, 1] 8191.0\n", "")


def test_the_points_of_a_cloud_arrive_without_another_copy(start: Start) -> None:
    output, errors = finished(
        start("""
import minirospy.runtime.transport.readers as readers
from sensor_msgs.msg import PointCloud2
rospy.init_node("both")
publisher = rospy.Publisher("/t", PointCloud2, queue_size=10)
frames, got = [], []
split_frame = readers.split_frame
def keep(*parts):
    frames.append(split_frame(*parts))
    return frames[-1]
readers.split_frame = keep
rospy.Subscriber("/t", PointCloud2, got.append)
publisher.wait_for_subscribers()
publisher.publish(PointCloud2(data=bytes(range(256)) * 1000, is_dense=True))
print(eventually(lambda: got), got[0].data is frames[0].array, got[0].is_dense, got[0].data == bytes(range(256)) * 1000)
""")
    )
    assert (output, errors) == ("True True True True\n", "")


def test_a_class_that_overrides_deserialize_receives_bytes(start: Start) -> None:
    """Such a class may keep the bytes, as in rospy, or read them in another way than a generated class."""
    output, errors = finished(
        start("""
from sensor_msgs.msg import PointCloud2
class Cloud(PointCloud2):
    def deserialize(self, data):
        self.received = data
        return self
class Raw(rospy.AnyMsg):
    def deserialize(self, data):
        self._buff = data
        return self
rospy.init_node("both")
publisher = rospy.Publisher("/t", PointCloud2, queue_size=10)
relay = rospy.Publisher("/copy", Raw, queue_size=10)
clouds, copies = [], []
rospy.Subscriber("/t", Cloud, clouds.append)
rospy.Subscriber("/t", Raw, relay.publish)
rospy.Subscriber("/copy", PointCloud2, copies.append)
publisher.wait_for_subscribers()
relay.wait_for_subscribers()
for size in (100, 200_000):
    publisher.publish(PointCloud2(data=bytes(size), is_dense=True))
print(eventually(lambda: len(clouds) == len(copies) == 2))
print([type(cloud.received).__name__ for cloud in clouds], [len(copy.data) for copy in copies], copies[1].is_dense)
""")
    )
    assert (output, errors) == ("True\n['bytes', 'bytes'] [100, 200000] True\n", "")


def test_numpy_scalars_are_values(start: Start) -> None:
    pytest.importorskip("numpy")
    output, _ = finished(
        start("""
import numpy
rospy.init_node("talker")
for kind, value in ((Bool, numpy.array([1, 3])[1] > 2), (Bool, numpy.any([False])), (Int32, numpy.arange(3).sum())):
    publisher = rospy.Publisher(kind.__name__, kind, queue_size=10)
    got = []
    rospy.Subscriber(kind.__name__, kind, got.append)
    publisher.wait_for_subscribers()
    publisher.publish(value)
    print(eventually(lambda: got), got[0].data)
""")
    )
    assert output == "True True\nTrue False\nTrue 3\n"


def test_listeners_are_notified_in_order_and_a_faulty_one_ends_nothing(start: Start) -> None:
    output, errors = finished(
        start("""
rospy.init_node("talker")
calls = []
class Listener(rospy.SubscribeListener):
    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        threading.Event().wait(0.05)
        calls.append("come")
        raise ValueError("bad listener")
    def peer_unsubscribe(self, topic_name, num_peers):
        calls.append("gone")
publisher = rospy.Publisher("/t", Bool, Listener(), queue_size=1)
for _ in range(3):
    subscriber = rospy.Subscriber("/t", Bool)
    publisher.wait_for_subscribers()
    subscriber.unregister()
    eventually(lambda: publisher.get_num_connections() == 0)
print(eventually(lambda: len(calls) == 6), calls)
""")
    )
    assert output == "True ['come', 'gone', 'come', 'gone', 'come', 'gone']\n"
    assert errors.count("ValueError: bad listener") == 3


def test_slow_callback_gets_the_newest_message(start: Start) -> None:
    """This is a common mistake: large images, a slow callback, queue_size=1 and the default buff_size."""
    output, _ = finished(
        start("""
rospy.init_node("camera")
publisher = rospy.Publisher("/image", Image, queue_size=1)
heard, go_on = [], threading.Event()
def callback(image):
    heard.append(image.height)
    go_on.wait(30)
rospy.Subscriber("/image", Image, callback, queue_size=1)
publisher.wait_for_subscribers()
data = bytes(900_000)
for number in range(1, 101):
    publisher.publish(Image(height=number, data=data))
    assert number > 1 or eventually(lambda: heard)
go_on.set()
assert eventually(lambda: 100 in heard)
print(len(heard) < 10, heard[-1])
""")
    )
    # If all messages arrived in order, the second would follow the first. Messages in the sockets may still come
    # before the newest.
    assert output == "True 100\n"


LISTENER = """
rospy.init_node("listener")
rospy.Subscriber("/t", String, lambda message: print(message.data, flush=True))
print("ready", flush=True)
rospy.spin()
"""
TALKER = """
rospy.init_node("talker")
publisher = rospy.Publisher("/t", String, queue_size=1)
publisher.wait_for_subscribers()
publisher.publish("{text}")
sys.stdin.read()
"""


AT_ONCE = """
import minirospy.client.{module} as module

rospy.init_node("n")
arrived = threading.Event()
ends = []

def create():
    ends.append(rospy.{create})

def let_another_begin(wait):
    module.unregister_from_master = unregister_from_master
    other = threading.Thread(target=create)
    other.start()
    other.join(20)
    unregister_from_master(wait)

unregister_from_master = module.unregister_from_master
module.unregister_from_master = let_another_begin
create()
ends[0].unregister()
peer = rospy.{peer}
eventually(ends[1].get_num_connections)
print(ends[1].get_num_connections())
"""


@pytest.mark.parametrize("kind", ["Publisher", "Subscriber"])
def test_a_topic_that_one_thread_leaves_another_may_join_at_that_moment(start: Start, kind: str) -> None:
    calls = ['Subscriber("/t", Bool)', 'Publisher("/t", Bool, queue_size=1)']
    create, peer = calls if kind == "Subscriber" else calls[::-1]
    assert finished(start(AT_ONCE.format(module=kind.lower(), create=create, peer=peer))) == ("1\n", "")


FIRST_AT_ONCE = """
rospy.init_node("n")
sys.setswitchinterval(1e-6)
for number in range(40):
    gate = threading.Barrier(4)

    def create():
        gate.wait()
        ends.append(rospy.{create})

    ends = []
    threads = [threading.Thread(target=create) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(ends) == 4
    for end in ends:
        end.unregister()
print("done")
"""


@pytest.mark.parametrize("create", ['Subscriber(f"/t{number}", Bool)', 'Publisher("/t", Bool, queue_size=1)'])
def test_several_threads_may_be_the_first_of_a_topic(start: Start, create: str) -> None:
    assert finished(start(FIRST_AT_ONCE.format(create=create))) == ("done\n", "")


LATCHED_MEANWHILE = """
from minirospy.client.subscriber import SubscribedTopic

rospy.init_node("n")
publisher = rospy.Publisher("/t", Int32, latch=True, queue_size=1)
publisher.publish(1)
early, late = [], []
rospy.Subscriber("/t", Int32, early.append)
eventually(lambda: early)
join = SubscribedTopic.join

def join_a_moment_later(*args):
    publisher.publish(2)
    eventually(lambda: len(early) == 2)
    join(*args)

SubscribedTopic.join = join_a_moment_later
rospy.Subscriber("/t", Int32, late.append)
SubscribedTopic.join = join
print([message.data for message in late])

def on_message(message):
    if message.data == 2:
        publisher.publish(3)
        eventually(lambda: newest == [3])
    newest.append(message.data)

newest = []
rospy.Subscriber("/t", Int32, on_message)
print(newest[-1])
"""


def test_a_latched_message_during_a_join_is_delivered_last(start: Start) -> None:
    assert finished(start(LATCHED_MEANWHILE)) == ("[2]\n3\n", "")


def test_messages_of_a_killed_publisher_that_restarts_are_received(start: Start) -> None:
    listener = start(LISTENER)
    assert line(listener) == "ready"
    first = start(TALKER.format(text="one"))
    assert line(listener) == "one"
    first.kill()
    first.wait()
    start(TALKER.format(text="two"))
    assert line(listener) == "two"
    assert listener.poll() is None


def test_a_killed_subscriber_is_nothing_to_its_publisher(start: Start) -> None:
    listener = start(LISTENER)
    assert line(listener) == "ready"
    talker = start("""
rospy.init_node("talker")
publisher = rospy.Publisher("/t", String, queue_size=None)
publisher.wait_for_subscribers()
print("connected", flush=True)
sys.stdin.readline()
while publisher.get_num_connections():
    publisher.publish("x" * 1000)
publisher.publish("to nobody")
print("alone", flush=True)
""")

    assert line(talker) == "connected"
    listener.kill()
    output, errors = talker.communicate("go\n", timeout=30)

    assert (output, talker.returncode) == ("alone\n", 0)
    # Python 3.13 also prints the source line.
    (warning,) = [text for text in errors.splitlines() if not text.startswith(" ")]
    assert "SyntaxWarning" in warning


def test_subscriber_joining_a_connecting_latched_publisher_gets_message(start: Start) -> None:
    """The publisher connects, and its message arrives, between the two halves of the constructor."""
    output, _ = finished(
        start("""
from minirospy.client.subscriber import SubscribedTopic
rospy.init_node("n")
first, second = threading.Event(), threading.Event()
rospy.Subscriber("/t", String, lambda _: first.set())
join = SubscribedTopic.join
def join_late(*args):
    global publisher
    publisher = rospy.Publisher("/t", String, latch=True, queue_size=1)
    publisher.publish("latched")
    assert first.wait(30)
    join(*args)
SubscribedTopic.join = join_late
rospy.Subscriber("/t", String, lambda _: second.set())
print(second.wait(30))
""")
    )
    assert output == "True\n"


NOT_A_LISTENER = """
rospy.init_node("talker")
publisher = rospy.Publisher("/t", Int32, 10)
got = []
subscriber = rospy.Subscriber("/t", Int32, lambda message: got.append(message.data))
print(publisher.wait_for_subscribers(timeout=30))
publisher.publish(3)
print(eventually(lambda: got), got, publisher.get_num_connections())
"""


def test_queue_size_as_the_third_argument_is_named_and_the_topic_works(start: Start) -> None:
    output, errors = finished(start(NOT_A_LISTENER))
    assert output == "True\nTrue [3] 1\n"
    warnings = [each for each in errors.splitlines() if "subscriber_listener 10 is ignored" in each]
    assert len(warnings) == 1
    assert warnings[0].endswith("write queue_size=10")
    assert "Traceback" not in errors


def test_listener_with_one_method_that_is_a_faulty_property_ends_nothing(start: Start) -> None:
    output, errors = finished(
        start("""
rospy.init_node("talker")
class Listener:
    @property
    def peer_subscribe(self):
        raise LookupError("bad property")
publisher = rospy.Publisher("/t", Int32, queue_size=1)
publisher.impl.subscriber_listeners.append(Listener())
got = []
subscriber = rospy.Subscriber("/t", Int32, lambda message: got.append(message.data))
print(publisher.wait_for_subscribers(timeout=30))
publisher.publish(3)
print(eventually(lambda: got), publisher.get_num_connections())
subscriber.unregister()
print(eventually(lambda: publisher.get_num_connections() == 0))
""")
    )
    assert output == "True\nTrue 1\nTrue\n"
    assert errors.count("LookupError: bad property") == 1


MISSING_SPIN = (
    "the program ends while it subscribes to {}, before any message has arrived. "
    "rospy.spin() at its end keeps it running"
)


@pytest.mark.parametrize(
    ("body", "topics"),
    [
        ("", "/t"),
        ("rospy.Subscriber('a', Bool, print)", "/a, /t"),
        ("time.sleep(0.01)", "/t"),
        ("sub.unregister()", ""),
        ("rospy.spin()", ""),
        ("rospy.is_shutdown()", ""),
        ("rospy.sleep(0.01)", ""),
        ("pub = rospy.Publisher('t', Bool, queue_size=1, latch=True); pub.publish(True); got.wait()", ""),
        ("rospy.signal_shutdown('')", ""),
        ("rospy.Subscriber('t', Bool); sub.unregister()", ""),
        ("sys.ps1 = '> '", ""),
        ("from minirospy.client import subscriber; subscriber.NEW_SECONDS = 0.0", ""),
        ("1 / 0", ""),
    ],
)
def test_program_without_spin_is_named(start: Start, body: str, topics: str) -> None:
    program = start(f"""
import time
rospy.init_node("n")
got = threading.Event()
sub = rospy.Subscriber("t", Bool, lambda message: got.set())
if {body == "rospy.spin()"}:
    threading.Timer(0.1, rospy.signal_shutdown, [""]).start()
{body}
""")
    _, errors = program.communicate(timeout=60)
    assert program.returncode == int(body == "1 / 0")
    lines = [line.partition("]: ")[2] for line in errors.splitlines() if line.startswith("[WARN]")]
    assert lines == ([MISSING_SPIN.format(topics)] if topics else [])
