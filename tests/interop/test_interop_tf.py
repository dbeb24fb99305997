"""tf2 and tf compared with Debian's: both answer the same queries, and exchange transforms between minirospy and roscpp."""

from __future__ import annotations

import json
import math
import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from minirospy.ros.tf.tf import transformations
from tests.core.tf2.conversation import difference, edge_cases, query_real, questions, shortened
from tests.core.tf2.ours import our_answers
from tests.interop.conftest import HERE, PATIENCE, REAL_PYTHON, compiled, start, stop
from tests.ros.tf2_ros import transformations_calls

RECORDED = HERE.parent / "core" / "tf2" / "recorded.json"

OUR_PEER = """
import sys, rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
role = sys.argv[1]
rospy.init_node("our_" + role)
if role == "send":
    broadcaster, latched = tf2_ros.TransformBroadcaster(), tf2_ros.StaticTransformBroadcaster()
else:
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)
print("ready", flush=True)
for line in sys.stdin:
    words = line.split()
    if role == "send":
        message = TransformStamped()
        message.header.frame_id, message.child_frame_id = words[1:3]
        message.header.stamp = rospy.Time(int(words[3]), int(words[4]))
        where, turn = message.transform.translation, message.transform.rotation
        where.x, where.y, where.z, turn.x, turn.y, turn.z, turn.w = map(float, words[5:])
        (latched if words[0] == "1" else broadcaster).sendTransform(message)
        print("sent", flush=True)
        continue
    time, timeout = rospy.Time(int(words[2]), int(words[3])), rospy.Duration.from_sec(float(words[4]))
    try:
        found = buffer.lookup_transform(words[0], words[1], time, timeout)
    except tf2_ros.TransformException as error:
        print("error", error, flush=True)
        continue
    where, turn, stamp = found.transform.translation, found.transform.rotation, found.header.stamp
    print(stamp.secs, stamp.nsecs, where.x, where.y, where.z, turn.x, turn.y, turn.z, turn.w, flush=True)
"""
START = 1_700_000_000  # seconds; at this size, a float in seconds does not resolve nanoseconds


@pytest.mark.parametrize("lazily", [False, True], ids=["inserted", "as_bytes"])
def test_ten_thousand_lookups_are_equal(lazily: bool) -> None:
    conversations = [questions(seed, 100) for seed in range(1000, 1110)]
    real = query_real(conversations)
    lookups, different = 0, []
    for queries, answers in zip(conversations, real, strict=True):
        for question, was, is_ in zip(queries, answers, our_answers(queries, lazily=lazily), strict=True):
            lookups += question[0] not in {"set", "yaml", "string", "dot", "frames"}
            if text := difference(was, is_):
                different.append(f"{question}: {text}")
    assert lookups >= 10_000
    assert different == []


def test_record_matches_answers_of_real_tf2() -> None:
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    conversations = [queries for queries, _ in recorded]
    assert conversations[: len(edge_cases())] == edge_cases()
    for (_, kept), answers in zip(recorded, query_real(conversations), strict=True):
        assert not [
            text for was, is_ in zip(kept, answers, strict=True) if (text := difference(was, shortened(is_)))
        ]


def test_transformations_return_the_same_as_the_real_module() -> None:
    done = subprocess.run(
        [REAL_PYTHON, transformations_calls.__file__, *map(str, range(100, 115))],
        capture_output=True,
        text=True,
        check=True,
    )
    for made, real in json.loads(done.stdout):
        ours = transformations_calls.results(transformations, made)
        different = [
            call
            for call, was, is_ in zip(made, real, ours, strict=True)
            if not transformations_calls.is_near(was, is_)
        ]
        assert different == []


@pytest.fixture(scope="module")
def tf_peer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the compiled tf_peer.cpp."""
    return compiled("tf_peer.cpp", tmp_path_factory, "tf2_ros")


class Peer:
    """A program that responds to each line with a line."""

    def __init__(self, program: subprocess.Popen[str]) -> None:
        self._program = program
        assert self._read() == "ready"

    def ask(self, *words: object) -> str:
        """Send a line; return the response."""
        assert self._program.stdin
        self._program.stdin.write(" ".join(map(str, words)) + "\n")
        self._program.stdin.flush()
        return self._read()

    def _read(self) -> str:
        assert self._program.stdout
        return self._program.stdout.readline().rstrip("\n")


@contextmanager
def running(stack: str, role: str, program: Path, uri: str) -> Iterator[Peer]:
    """Run a peer of minirospy or of roscpp."""
    command = [str(program), role] if stack == "roscpp" else [sys.executable, "-c", OUR_PEER, role]
    started = start(command, uri, "ours" if stack == "ours" else "roscpp")
    try:
        yield Peer(started)
    finally:
        stop(started)


@pytest.mark.parametrize(("sender", "listener"), [("ours", "roscpp"), ("roscpp", "ours")])
def test_transforms_between_minirospy_and_roscpp(
    sender: str, listener: str, tf_peer: Path, real_master: str
) -> None:
    rng = random.Random(7)

    def pose() -> list[float]:
        angle = rng.uniform(-3, 3)
        return [rng.uniform(-9, 9), rng.uniform(-9, 9), 0.25, 0.0, 0.0, math.sin(angle), math.cos(angle)]

    with (
        running(sender, "send", tf_peer, real_master) as send,
        running(listener, "listen", tf_peer, real_master) as listen,
        running(sender, "listen", tf_peer, real_master) as twin,
    ):
        send.ask(1, "map", "world", 0, 0, *pose())
        send.ask(1, "wrist", "hand", 0, 0, *pose())
        # Repeat until both listeners are connected to /tf.
        for n in range(1000):
            send.ask(0, "world", "ready", START, n, *pose())
            answers = [each.ask("map", "ready", 0, 0, 0.05) for each in (listen, twin)]
            if not any(answer.startswith("error") for answer in answers):
                break
        for n in range(1, 20):
            for parent, child in (("world", "base"), ("base", "arm"), ("arm", "wrist")):
                send.ask(0, parent, child, START, n * 1_000_003, *pose())

        last = 19 * 1_000_003
        questions: list[tuple[object, ...]] = [("map", "hand", START, last, 30)]
        for _ in range(60):
            frames = rng.sample(["map", "world", "base", "arm", "wrist", "hand", "nowhere"], 2)
            questions.append((*frames, START, rng.randrange(900_000, last + 100_000), 0))
        for question in questions:
            found, expected = (each.ask(*question) for each in (listen, twin))
            if "error" in (found[:5], expected[:5]):
                assert found == expected
            else:
                numbers, others = ([float(word) for word in answer.split()] for answer in (found, expected))
                assert numbers == pytest.approx(others, rel=1e-12, abs=1e-12), question


OUR_SERVER = """
import rospy, tf2_ros
rospy.init_node("our_server")
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
server = tf2_ros.BufferServer(buffer, "tf2_buffer_server", True)
rospy.spin()
"""
CLIENT = """
import rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
rospy.init_node("client", anonymous=True)
static = tf2_ros.StaticTransformBroadcaster()
pose = TransformStamped(child_frame_id="base")
pose.header.frame_id = "map"
pose.transform.translation.x, pose.transform.rotation.w = 2.5, 1.0
static.sendTransform(pose)
# So long may the server stall.
client = tf2_ros.BufferClient("tf2_buffer_server", timeout_padding=rospy.Duration(20))
print(client.wait_for_server(rospy.Duration(150)))


def patiently(call, *arguments):
    # actionlib's client in Python misses an answer that comes before its send_goal() has returned.
    while True:
        try:
            return call(*arguments)
        except tf2_ros.TimeoutException:
            continue


found = patiently(client.lookup_transform, "map", "base", rospy.Time(0), rospy.Duration(60))
print(found.transform.translation.x, found.header.frame_id, found.child_frame_id)
print(client.can_transform("map", "nowhere", rospy.Time(0)))
for call in (
    lambda: client.lookup_transform("map", "nowhere", rospy.Time(0)),
    lambda: client.lookup_transform("/map", "base", rospy.Time(0)),
    lambda: client.lookup_transform_full("base", rospy.Time(1), "base", rospy.Time(2), "nowhere"),
):
    try:
        patiently(call)
    except tf2_ros.TransformException as error:
        print(type(error).__name__, error)
full = patiently(client.lookup_transform_full, "base", rospy.Time(1), "base", rospy.Time(2), "map")
print(full.transform.translation.x)
"""
ANSWERED = """\
True
2.5 map base
False
LookupException "nowhere" passed to lookupTransform argument source_frame does not exist.
InvalidArgumentException Invalid argument "/map" passed to lookupTransform argument target_frame in tf2 frame_ids cannot start \
with a '/' like:
LookupException "nowhere" passed to lookupTransform argument fixed_frame does not exist.
0.0
"""


@pytest.mark.parametrize(("server", "client"), [("roscpp", "ours"), ("ours", "rospy"), ("roscpp", "rospy")])
def test_buffer_servers_and_clients(server: str, client: str, real_master: str) -> None:
    """The last pair is the reference."""
    command = ["/usr/lib/tf2_ros/buffer_server"] if server == "roscpp" else [sys.executable, "-c", OUR_SERVER]
    serving = start(command, real_master, server)
    try:
        python = sys.executable if client == "ours" else REAL_PYTHON
        looking = start([python, "-c", CLIENT], real_master, client)
        printed, errors = looking.communicate(timeout=PATIENCE)
        assert [line.rstrip() for line in printed.splitlines()] == ANSWERED.splitlines(), errors
    finally:
        stop(serving)
