"""tf2_ros in programs: listeners, waits, time jumps, buffer servers. tests/core/tf2 tests tf2 itself."""

from __future__ import annotations

import subprocess
import sys

import pytest

BEGIN = """
import threading, rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
def stamped(parent, child, stamp, x=0.0, w=1.0):
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.transform.translation.x, message.transform.rotation.w = x, w
    return message
NOW, LONG = rospy.Time(0), rospy.Duration(60)
"""
INIT = """
rospy.init_node("frames", argv=[], disable_rosout=True)
"""
END = """
rospy.signal_shutdown("")
print("end")
"""


def run(code: str, *, init: str = INIT) -> str:
    """Run a program; return its output and log."""
    done = subprocess.run(
        [sys.executable, "-c", BEGIN + init + code + END],
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.stdout.endswith("end\n"), done.stdout + done.stderr
    return done.stdout[: -len("end\n")] + done.stderr


@pytest.mark.usefixtures("master")
class TestListener:
    def test_broadcast_transforms_are_found(self) -> None:
        said = run("""
static = tf2_ros.StaticTransformBroadcaster()
static.sendTransform(stamped("map", "odom", 0, 1.0))
static.sendTransform([stamped("base", "laser", 0, 5.0)])
# Keeps all of them: the stamps advance by 1 s each 10 ms.
buffer = tf2_ros.Buffer(rospy.Duration(10000))
listener = tf2_ros.TransformListener(buffer)
broadcaster = tf2_ros.TransformBroadcaster()
def send():
    for n in range(1, 10000):
        broadcaster.sendTransform([stamped("odom", "base", n, n), stamped("base", "wheel", n, 0.5)])
        if done.wait(0.01):
            break
done = threading.Event()
thread = threading.Thread(target=send)
thread.start()
found = buffer.lookup_transform("map", "laser", NOW, LONG)
done.set()
thread.join()
print(found.transform.translation.x == 6.0 + found.header.stamp.to_sec(), found.header.frame_id, found.child_frame_id)
print(type(found.header.stamp))
print(buffer.lookup_transform("odom", "wheel", found.header.stamp).transform.translation.x == found.header.stamp.to_sec() + 0.5)
""")
        assert said.startswith("True map laser\n<class 'rospy.rostime.Time'>\nTrue\n")

    def test_a_listener_that_comes_later_gets_all_static_transforms(self) -> None:
        said = run("""
static = tf2_ros.StaticTransformBroadcaster()
for x, child in enumerate(["a", "b", "a"]):
    static.sendTransform(stamped("map", child, 0, x))
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
for child in ("a", "b"):
    print(buffer.lookup_transform("map", child, NOW, LONG).transform.translation.x)
""")
        assert said == "2.0\n1.0\n"

    def test_broadcasters_of_a_process_do_not_hide_each_others_static_transforms(self) -> None:
        said = run("""
first, second = tf2_ros.StaticTransformBroadcaster(), tf2_ros.StaticTransformBroadcaster()
message = stamped("map", "a", 0, 1.0)
first.sendTransform(message)
message.child_frame_id = "b"
second.sendTransform(message)
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
for child in ("a", "b"):
    print(buffer.lookup_transform("map", child, NOW, LONG).transform.translation.x)
print([each.child_frame_id for each in first.net_message.transforms])
""")
        assert said == "1.0\n1.0\n['a', 'b']\n"

    def test_time_that_jumps_back_clears_the_buffer(self) -> None:
        said = run(
            """
from minirospy.client.session import current_session
from minirospy.base.clock import SimulatedClock
session = current_session()
session.clock = SimulatedClock(10 * 10**9)
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
from tf2_msgs.msg import TFMessage
def come(*transforms):
    message = TFMessage(list(transforms))
    message._connection_header = {"callerid": "/me"}
    listener.callback(message)
buffer.set_transform_static(stamped("map", "s", 0), "me")
come(stamped("map", "a", 9))
print(buffer.can_transform("map", "a", NOW))
session.clock.set(8_500_000_000)
come(stamped("map", "b", 8))
print(buffer.can_transform("map", "a", NOW), buffer.can_transform("map", "b", NOW), buffer.can_transform("map", "s", NOW))
print(listener.last_update.to_sec())
"""
        )
        assert said.startswith("1\n0 1 1\n8.5\n")
        assert "Detected jump back in time of 1.500000s. Clearing TF buffer." in said

    def test_a_programs_own_buffer_gets_each_transform(self) -> None:
        said = run("""
seen = threading.Event()
class Mine(tf2_ros.Buffer):
    def set_transform(self, transform, authority):
        print(transform.child_frame_id, transform.transform.translation.x, authority)
        if transform.child_frame_id == "b":
            seen.set()
listener = tf2_ros.TransformListener(Mine())
broadcaster = tf2_ros.TransformBroadcaster()
broadcaster.pub_tf.wait_for_subscribers()
broadcaster.sendTransform([stamped("map", "a", 1, 2.5), stamped("map", "b", 1)])
seen.wait(60)
""")
        assert said == "a 2.5 /frames\nb 0.0 /frames\n"

    def test_bytes_that_are_not_transforms_are_one_line(self) -> None:
        said = run("""
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
from minirospy.ros.tf2_ros.tf2_ros.messages import LazyTFMessage
message = LazyTFMessage().deserialize(b"\\1\\0\\0\\0abc")
message._connection_header = {"callerid": "/me"}
listener.callback(message)
""")
        assert "a message of /me is not a tf2_msgs/TFMessage: unpack_from requires" in said
        assert "Traceback" not in said

    def test_listening_ends(self) -> None:
        said = run("""
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
other = tf2_ros.TransformListener(buffer)
listener.unregister()
from minirospy.client.session import current_session
print(sorted(current_session().subscribed))
other.unregister()
print(sorted(current_session().subscribed))
""")
        assert said == "['/tf', '/tf_static']\n[]\n"


@pytest.mark.usefixtures("master")
class TestWaiting:
    def test_a_wait_ends_by_the_insertion(self) -> None:
        said = run("""
import minirospy.ros.tf2_ros.tf2_ros.waiting as module
buffer = tf2_ros.Buffer()
waits = []
def wait(event, seconds):
    waits.append(seconds)
    if len(waits) > 1:
        buffer.set_transform(stamped("map", "base", 1), "me")
    else:
        buffer.set_transform(stamped("map", "other", 1), "me")
    print(event.is_set())
module.wait_for_event = wait
print(buffer.lookup_transform("map", "base", rospy.Time(1), rospy.Duration(70)).header.stamp)
print(len(waits), all(0 < each <= 70 for each in waits))
""")
        assert said == "True\nTrue\n1000000000\n2 True\n"

    def test_a_timeout_ends_with_the_text_of_the_lookup(self) -> None:
        said = run("""
buffer = tf2_ros.Buffer()
for function, arguments in (
    (buffer.lookup_transform, ("map", "base", NOW)),
    (buffer.lookup_transform_full, ("map", NOW, "base", NOW, "odom")),
):
    try:
        function(*arguments, rospy.Duration(0.05))
    except tf2_ros.LookupException as error:
        print(error)
print(buffer.can_transform("map", "base", NOW, rospy.Duration(0.05), return_debug_tuple=True))
print(buffer.can_transform_full("map", NOW, "base", NOW, "odom", rospy.Duration(0.05), True))
""")
        assert said == (
            '"map" passed to lookupTransform argument target_frame does not exist. \n'
            * 2
            + "(0, 'canTransform: target_frame map does not exist. canTransform: source_frame base does not exist.')\n"
            "(0, 'canTransform: target_frame map does not exist. canTransform: source_frame base does not exist. "
            "fixed_frame: odomdoes not exist.')\n"
        )

    def test_a_wait_ends_by_the_shutdown(self) -> None:
        said = run("""
import minirospy.ros.tf2_ros.tf2_ros.waiting as module
real = module.wait_for_event
def wait(event, seconds):
    threading.Thread(target=rospy.signal_shutdown, args=("enough",)).start()
    real(event, seconds)
module.wait_for_event = wait
try:
    tf2_ros.Buffer().lookup_transform("map", "base", NOW, LONG)
except rospy.ROSInterruptException as error:
    print(error)
""")
        assert said == "ROS shutdown request\n"

    @pytest.mark.parametrize("jump", [50, 3.5, 2.5, 0.1])
    def test_simulated_time_that_jumps_back_ends_a_wait(self, jump: float) -> None:
        said = run(f"""
import minirospy.ros.tf2_ros.tf2_ros.waiting as module
import tf
from minirospy.client.session import current_session
from minirospy.base.clock import SimulatedClock
def wait(event, seconds):
    clock.set(next(times))
module.wait_for_event = wait
buffer, listener = tf2_ros.Buffer(), tf.TransformListener()
arguments = "map", NOW, "base", NOW, "map"
for call in (
    lambda: buffer.can_transform("map", "base", NOW, rospy.Duration(5)),
    lambda: buffer.lookup_transform("map", "base", NOW, rospy.Duration(5)),
    lambda: buffer.can_transform_full(*arguments, rospy.Duration(5)),
    lambda: buffer.lookup_transform_full(*arguments, rospy.Duration(5)),
    lambda: listener.waitForTransform("map", "base", NOW, rospy.Duration(5)),
):
    clock = current_session().clock = SimulatedClock(100 * 10**9)
    times = iter([101 * 10**9, 101 * 10**9 - {int(jump * 1e9)}])
    try:
        call()
    except rospy.ROSTimeMovedBackwardsException as error:
        print(error, error.time)
""")
        assert said == f"ROS time moved backwards {float(jump)}\n" * 5

    def test_jump_back_within_a_polling_interval_is_waited_through(self) -> None:
        said = run("""
import minirospy.ros.tf2_ros.tf2_ros.waiting as module
from minirospy.client.session import current_session
from minirospy.base.clock import SimulatedClock
clock = current_session().clock = SimulatedClock(100 * 10**9)
times = iter([100_500_000_000, 100_200_000_000, 161 * 10**9])
module.wait_for_event = lambda event, seconds: clock.set(next(times))
print(tf2_ros.Buffer().can_transform("map", "base", NOW, LONG))
""")
        assert said == "0\n"

    def test_waiting_needs_a_node(self) -> None:
        said = run(
            """
buffer = tf2_ros.Buffer(debug=False)
try:
    buffer.lookup_transform("map", "base", NOW, LONG)
except rospy.ROSInitException as error:
    print(error)
buffer.set_transform(stamped("map", "base", 3, 4.0), "me")
print(buffer.lookup_transform("map", "base", NOW, LONG).transform.translation.x)
""",
            init="",
        )
        assert said == "time is not initialized. Have you called init_node()?\n4.0\n"


@pytest.mark.usefixtures("master")
class TestBuffer:
    def test_each_node_lists_its_frames_as_a_service(self) -> None:
        said = run("""
from tf2_msgs.srv import FrameGraph
buffer, other, third = tf2_ros.Buffer(), tf2_ros.Buffer(), tf2_ros.Buffer(rospy.Duration(3), debug=False)
buffer.set_transform(stamped("map", "base", 2), "me")
print(rospy.ServiceProxy("/frames/tf2_frames", FrameGraph)().frame_yaml)
""")
        assert said == (
            "base: \n  parent: 'map'\n  broadcaster: 'me'\n  rate: 10000.000\n  most_recent_transform: 2.000\n"
            "  oldest_transform: 2.000\n  buffer_length: 0.000\n\n"
        )

    def test_wrong_arguments_are_named(self) -> None:
        said = run("""
buffer = tf2_ros.Buffer()
for call in (
    lambda: buffer.lookup_transform("a", "b", 5.0),
    lambda: buffer.lookup_transform(1, "b", NOW),
    lambda: tf2_ros.Buffer(10),
    lambda: buffer.set_transform(TransformStamped(child_frame_id=3), "me"),
):
    try:
        call()
    except TypeError as error:
        print(error)
print(buffer.can_transform("/a", "b", NOW), buffer.can_transform("a", "", NOW))
""")
        assert said.startswith(
            "time must have a to_sec method, e.g. rospy.Time or rospy.Duration\n"
            "argument 1 must be str, not int\n"
            "time must have a to_sec method, e.g. rospy.Time or rospy.Duration\n"
            "argument 2 must be str, not int\n"
            "0 0\n"
        )
        assert (
            'Invalid argument "/a" passed to canTransform argument target_frame in tf2 frame_ids cannot start'
            in said
        )
        assert (
            "Invalid argument passed to canTransform argument source_frame in tf2 frame_ids cannot be empty"
            in said
        )

    def test_a_flood_of_repeated_data_is_one_line(self) -> None:
        said = run("""
import minirospy.ros.tf2_ros.tf2_ros.core as core
buffer = tf2_ros.Buffer()
times = [0.0]
buffer._refusals._clock = lambda: times[-1]
for n in range(1000):
    buffer.set_transform(stamped("map", "base", 2), "/me")
times.append(1.0)
buffer.set_transform(stamped("map", "base", 2), "/me")
""")
        lines = [line.partition("]: ")[2] for line in said.splitlines()]
        text = "TF_REPEATED_DATA ignoring data with redundant timestamp for frame base (parent map) at time 2.000000 "
        assert lines == [
            text + "according to authority /me",
            text + "according to authority /me (998 more like it in 1 s)",
        ]

    def test_threads_share_a_buffer(self) -> None:
        said = run("""
buffer = tf2_ros.Buffer()
def insert(child):
    for n in range(1, 2000):
        buffer.set_transform(stamped("map", child, n * 0.001, 1.0), "me")
threads = [threading.Thread(target=insert, args=(child,)) for child in "abcd"]
for thread in threads:
    thread.start()
wrong = []
while any(thread.is_alive() for thread in threads):
    for pair in ("ab", "cd", "ad"):
        try:
            if buffer.lookup_transform(*pair, NOW).transform.translation.x != 0.0:
                wrong.append(pair)
        except tf2_ros.TransformException as error:
            if "does not exist" not in str(error):
                wrong.append(str(error))
print(wrong)
""")
        assert said == "[]\n"


@pytest.mark.usefixtures("master")
class TestServer:
    def test_a_client_gets_what_the_server_has(self) -> None:
        said = run("""
buffer = tf2_ros.Buffer()
server = tf2_ros.BufferServer(buffer, "server", True)
client = tf2_ros.BufferClient("server", timeout_padding=rospy.Duration(60))
print(client.wait_for_server(LONG))
for n in (1, 2, 3):
    buffer.set_transform(stamped("map", "base", n, n), "me")
print(client.lookup_transform("map", "base", rospy.Time(1, 500000000)).transform.translation.x)
print(client.lookup_transform_full("base", rospy.Time(3), "base", rospy.Time(1), "map").transform.translation.x)
print(client.can_transform("map", "base", NOW), client.can_transform("map", "nowhere", NOW))
for arguments in (("map", "nowhere", NOW), ("map", "base", rospy.Time(9)), ("/map", "base", NOW)):
    try:
        client.lookup_transform(*arguments)
    except tf2_ros.TransformException as error:
        print(type(error).__name__, error)
buffer.set_transform(stamped("other", "tree", 1), "me")
try:
    client.lookup_transform("map", "tree", NOW, rospy.Duration(0.05))
except tf2_ros.ConnectivityException as error:
    print(error)
threading.Timer(0.1, lambda: buffer.set_transform(stamped("map", "late", 1, 7.0), "me")).start()
print(client.lookup_transform("map", "late", NOW, LONG).transform.translation.x)
""")
        assert said == (
            "True\n1.5\n-2.0\nTrue False\n"
            'LookupException "nowhere" passed to lookupTransform argument source_frame does not exist. \n'
            "ExtrapolationException Lookup would require extrapolation 6.000000000s into the future.  Requested time "
            "9.000000000 but the latest data is at time 3.000000000, when looking up transform from frame [base] to frame "
            "[map]\n"
            'InvalidArgumentException Invalid argument "/map" passed to lookupTransform argument target_frame in tf2 '
            "frame_ids cannot start with a '/' like: \n"
            "Could not find a connection between 'map' and 'tree' because they are not part of the same tree.Tf has two or "
            "more unconnected trees.\n"
            "7.0\n"
        )

    def test_a_server_that_does_not_answer_is_a_timeout(self) -> None:
        said = run("""
client = tf2_ros.BufferClient("nobody", timeout_padding=rospy.Duration(0.05))
try:
    client.lookup_transform("map", "base", NOW)
except tf2_ros.TimeoutException as error:
    print(error)
""")
        assert said == (
            "The LookupTransform goal sent to the BufferServer did not come back in the specified time. Something is likely "
            "wrong with the server\n"
        )

    def test_a_goal_that_is_cancelled_is_not_answered(self) -> None:
        said = run("""
import actionlib
from tf2_msgs.msg import LookupTransformAction, LookupTransformGoal
buffer = tf2_ros.Buffer()
server = tf2_ros.BufferServer(buffer, "server")
server.start()
client = actionlib.SimpleActionClient("server", LookupTransformAction)
client.wait_for_server(LONG)
active = threading.Event()
goal = LookupTransformGoal(target_frame="map", source_frame="base", timeout=LONG)
client.send_goal(goal, active_cb=active.set)
active.wait()
client.cancel_goal()
client.wait_for_result(LONG)
print(client.get_state() == actionlib.GoalStatus.PREEMPTED, server._pending)
""")
        assert said == "True []\n"
