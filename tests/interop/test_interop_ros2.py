"""`minirospy ros2-bridge` with real ROS 2: bytes in both directions, late joiners, endpoints that leave, and no loops."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import queue
import shlex
import shutil
import socket
import subprocess
import sys
import textwrap
import threading
from collections.abc import Callable, Coroutine, Iterator, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import pytest
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal
from rosbags.typesys import Stores, get_typestore
from rosgraph_msgs.msg import Log

from minirospy import Node
from minirospy.aio.raw import RawService, call_raw, raw_class
from minirospy.base.errors import ServiceException
from minirospy.core.graph.goals import TERMINAL, GoalState
from minirospy.core.idl.load import message_class, service_class
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.snapshot import Snapshot, fetch
from minirospy.ros.actionlib.actionlib.aio import ActionClient, ActionServer, GoalError
from minirospy.runtime.transport.loop import LoopThread
from tests.interop.conftest import OUR_BIN, running_master
from tests.interop.install_ros2 import PYTHON, STAMP
from tests.waiting import until

_T = TypeVar("_T")
HERE = Path(__file__).parent
LIMIT = 90.0  # seconds to wait for a state before failing; much longer than a busy machine takes

DOMAIN_PORTS = 28_000

pytestmark = [
    pytest.mark.skipif(not STAMP.exists(), reason="ROS 2 is not installed: tests/interop/install_ros2.py"),
    pytest.mark.timeout(400),
]

TYPES = [
    "std_msgs/Bool", "std_msgs/Byte", "std_msgs/Char", "std_msgs/ColorRGBA", "std_msgs/Empty", "std_msgs/Float64",
    "std_msgs/Float64MultiArray", "std_msgs/Header", "std_msgs/Int64", "std_msgs/String", "std_msgs/UInt8MultiArray",
    "geometry_msgs/PointStamped", "geometry_msgs/PoseArray", "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/TransformStamped", "geometry_msgs/Twist", "sensor_msgs/CameraInfo", "sensor_msgs/CompressedImage",
    "sensor_msgs/Image", "sensor_msgs/Imu", "sensor_msgs/JointState", "sensor_msgs/Joy", "sensor_msgs/LaserScan",
    "sensor_msgs/NavSatFix", "sensor_msgs/PointCloud2", "nav_msgs/OccupancyGrid", "nav_msgs/Odometry", "nav_msgs/Path",
    "diagnostic_msgs/DiagnosticArray",
]  # fmt: skip


RULES = """
- {ros1_package_name: actionlib_tutorials, ros1_action_name: Fibonacci, ros2_package_name: test_msgs, ros2_action_name: Fibonacci}
- ros1_package_name: rospy_tutorials
  ros1_message_name: HeaderString
  ros2_package_name: diagnostic_msgs
  ros2_message_name: KeyValue
  fields_1_to_2: {data: value}
"""


class Peer:
    """ros2_peer.py in a process of real ROS 2, or another program with the same protocol."""

    def __init__(self, environment: dict[str, str], command: Sequence[str] = ()) -> None:
        self._said: queue.Queue[dict[str, Any]] = queue.Queue()
        self._kept: list[dict[str, Any]] = []
        self._program = subprocess.Popen(
            command or [str(PYTHON), str(HERE / "ros2_peer.py")],
            env=environment,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self._reading = threading.Thread(target=self._read)
        self._reading.start()
        self.wait(lambda each: each["op"] == "ready")

    def do(self, op: str, topic: str, **fields: Any) -> None:
        """Execute an operation and wait until it is done."""
        self.start(op, topic, **fields)
        self.wait(lambda each: (each["op"], each.get("of"), each.get("topic")) == ("done", op, topic))

    def start(self, op: str, topic: str, **fields: Any) -> None:
        assert self._program.stdin
        print(json.dumps({"op": op, "topic": topic, **fields}), file=self._program.stdin, flush=True)

    def message(self, topic: str) -> bytes:
        """Return the next message on a topic, as CDR without the header."""
        found = self.wait(lambda each: each["op"] == "message" and each["topic"] == topic)
        return bytes.fromhex(found["data"])[4:]

    def answer(self, service: str) -> dict[str, str]:
        """Return the fields of the next response to a call."""
        found = self.wait(lambda each: each["op"] == "answer" and each["topic"] == service)
        return dict(found["fields"])

    def wait(self, accepts: Callable[[dict[str, Any]], bool], limit: float = LIMIT) -> dict[str, Any]:
        for number, each in enumerate(self._kept):
            if accepts(each):
                return self._kept.pop(number)
        while True:
            each = self._said.get(timeout=limit)
            if accepts(each):
                return each
            assert each["op"] != "ended", "the peer has ended: see its error"
            self._kept.append(each)

    def has_said(self, topic: str, data: bytes) -> bool:
        """Return whether a message arrives within a moment; discard the messages that have arrived already."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._kept.append(self._said.get(timeout=0.5))
                if self._kept[-1]["op"] == "message":
                    break
        of_topic = [each for each in self._kept if each.get("topic") == topic and each["op"] == "message"]
        self._kept = [each for each in self._kept if each not in of_topic]
        return any(bytes.fromhex(each["data"])[4:].startswith(data) for each in of_topic)

    def close(self) -> None:
        assert self._program.stdin
        assert self._program.stdout
        self._program.stdin.close()
        try:
            self._program.wait(LIMIT)
        except subprocess.TimeoutExpired:
            self._program.kill()
            self._program.wait()
        self._reading.join()
        self._program.stdout.close()

    def _read(self) -> None:
        assert self._program.stdout
        for line in self._program.stdout:
            self._said.put(json.loads(line))
        self._said.put({"op": "ended"})


class Scene:
    """A master, the bridge, a ROS 1 node in this process, and a ROS 2 node in another."""

    def __init__(
        self,
        uri: str,
        environment: dict[str, str],
        parts: contextlib.ExitStack,
        command: Sequence[str] = (),
    ) -> None:
        self._loop = LoopThread("test-ros2")
        parts.callback(self._loop.close)
        self.environment = environment
        self.node: Node = self.run(self._start(uri))
        parts.callback(lambda: self.run(self.node.close()))
        self.peer = Peer(environment, command)
        parts.callback(self.peer.close)

    def run(self, work: Coroutine[object, object, _T]) -> _T:
        return self._loop.run(work, LIMIT + 30)

    async def _start(self, uri: str) -> Node:
        node = Node("tester", master_uri=uri, rosout=False)
        await node.start()
        return node

    def advertise(self, topic: str, type_: str, *, latch: bool = False) -> Any:
        async def advertise() -> Any:
            interface = InterfaceType.of(message_class(type_))
            return await self.node.advertise(topic, raw_class(interface), latch=latch)

        return self.run(advertise())

    def publish(self, publisher: Any, data: bytes) -> None:
        async def publish() -> None:
            publisher.publish_raw(data)

        self.run(publish())

    def serve(self, service: str, type_: str, answer: Callable[[bytes], bytes]) -> Any:
        """Offer a ROS 1 service; ``answer`` may raise ServiceException."""

        async def handler(request: bytes, _: object) -> bytes:
            return answer(request)

        async def serve() -> Any:
            return await RawService(self.node, service, InterfaceType.of(service_class(type_)), handler)

        return self.run(serve())

    def call(self, service: str, type_: str, *requests: bytes) -> list[bytes | BaseException]:
        """Call a ROS 1 service with several requests in parallel; return the responses or exceptions."""

        async def calling() -> list[bytes | BaseException]:
            calls = (call_raw(self.node, service, service_class(type_)._md5sum, each) for each in requests)
            return await asyncio.gather(*calls, return_exceptions=True)

        return self.run(calling())

    def subscribe(self, topic: str) -> tuple[Any, queue.Queue[bytes]]:
        came: queue.Queue[bytes] = queue.Queue()

        async def subscribe() -> Any:
            return await self.node.subscribe_raw(topic, lambda frame, _: came.put(bytes(frame)))

        return self.run(subscribe()), came

    def end(self, handle: Any) -> None:
        self.run(handle.close())

    def until(self, condition: Callable[[Snapshot], bool]) -> None:
        """Wait until the ROS 1 graph meets a condition."""

        async def holds() -> bool:
            return condition(await fetch(self.node.call_master))

        self.run(until(holds, LIMIT, pause=0.05))


def reserved_domain(parts: contextlib.ExitStack) -> str:
    """Return a ROS 2 domain that no other test on this machine uses until ``parts`` is closed, reserved with a bound port."""
    for number in range(1, 101):
        sock = parts.enter_context(socket.socket())
        with contextlib.suppress(OSError):
            sock.bind(("127.0.0.1", DOMAIN_PORTS + number))
            return str(number)
    raise AssertionError("all domains of ROS 2 are in use")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    with running_scene(tmp_path_factory.mktemp("ros2")) as (found, _):
        yield found


@contextlib.contextmanager
def running_scene(folder: Path) -> Iterator[tuple[Scene, subprocess.Popen[bytes]]]:
    """Run a scene with a bridge; assert that the bridge exits without an error."""
    with contextlib.ExitStack() as parts:
        uri = parts.enter_context(running_master("ours"))
        domain = reserved_domain(parts)
        environment = {
            # With minirospy's ROS 1 packages on the path, ROS 2's could not be imported.
            **{name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
            "ROS_MASTER_URI": uri,
            "ROS_DOMAIN_ID": domain,
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }
        rules = folder / "rules.yaml"
        rules.write_text(RULES)
        words = ["ros2-bridge", "--rules", str(rules)]
        code = f"import sys; from minirospy.cli.main import main; sys.exit(main({words}))"
        bridge = subprocess.Popen([str(PYTHON), "-c", code], env=environment)

        def end() -> None:
            bridge.terminate()
            assert bridge.wait(LIMIT) == 0

        parts.callback(end)
        yield Scene(uri, environment, parts), bridge


def sample(type_: str) -> bytes:
    """Return a ROS 1 message with non-default values."""
    message = message_class(type_)()
    _fill(message, 1)
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def _fill(message: Any, number: int) -> None:
    for place, (name, type_) in enumerate(zip(message.__slots__, message._slot_types, strict=True), number):
        base, bracket, length = type_.partition("[")
        count = int(length[:-1]) if length.rstrip("]") else 3
        values = [_value(base, place + each) for each in range(count if bracket else 1)]
        if bracket and base in ("uint8", "char"):
            setattr(message, name, bytes(values))
        else:
            setattr(message, name, values if bracket else values[0])


def _value(base: str, number: int) -> Any:
    from minirospy.base.times import Duration, Time

    if base == "string":
        return "x" * (number % 9)
    if base == "time":
        return Time(number, number)
    if base == "duration":
        return Duration(number, number)
    if base == "bool":
        return bool(number % 2)
    if base.startswith("float"):
        return number / 2
    if "/" not in base:
        return number % 100
    inner = message_class(base)()
    _fill(inner, number)
    return inner


def test_messages_are_those_that_rosbags_converts(scene: Scene) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    there: list[tuple[str, bytes, bytes]] = []
    for type_ in TYPES:
        data = sample(type_)
        topic = "/there/" + type_.replace("/", "_").lower()
        there.append((topic, data, bytes(store.ros1_to_cdr(data, type_.replace("/", "/msg/")))))
        scene.peer.do("subscribe", topic, type=type_, latched=True)
        scene.publish(scene.advertise(topic, type_, latch=True), data)
    for topic, _, cdr in there:
        # DDS pads to four bytes.
        assert scene.peer.message(topic) == cdr[4:] + bytes(-len(cdr) % 4), topic

    # Keep references, because rclpy destroys a subscription to which nothing refers.
    subscriptions = []
    back: list[tuple[str, queue.Queue[bytes], bytes]] = []
    for type_, (name, _, cdr) in zip(TYPES, there, strict=True):
        topic = name.replace("/there/", "/back/")
        subscription, came = scene.subscribe(topic)
        subscriptions.append(subscription)
        back.append((topic, came, bytes(store.cdr_to_ros1(cdr, type_.replace("/", "/msg/")))))
        scene.peer.do("publish", topic, type=type_, latched=True, data=cdr.hex())
    for topic, came, data in back:
        assert came.get(timeout=LIMIT) == data, topic
    for subscription in subscriptions:
        scene.end(subscription)


def test_late_subscriber_receives_latched_messages(scene: Scene) -> None:
    data = sample("std_msgs/String")
    publisher = scene.advertise("/late/to_ros2", "std_msgs/String", latch=True)
    scene.publish(publisher, data)
    scene.peer.do("subscribe", "/late/to_ros2", type="std_msgs/String", latched=True)
    first = scene.peer.message("/late/to_ros2")
    other = Peer(scene.environment)
    try:
        other.do("subscribe", "/late/to_ros2", type="std_msgs/String", latched=True)
        assert other.message("/late/to_ros2") == first
    finally:
        other.close()

    scene.peer.do(
        "publish", "/late/to_ros1", type="std_msgs/String", latched=True, data="000100000300000061620000"
    )
    for _ in range(2):
        subscription, came = scene.subscribe("/late/to_ros1")
        assert came.get(timeout=LIMIT) == b"\2\0\0\0ab"
        scene.end(subscription)


def test_the_bridge_leaves_a_topic_with_its_last_end(scene: Scene) -> None:
    bridge = "/minirospy_ros2_bridge"
    publisher = scene.advertise("/left/there", "std_msgs/Int64")
    scene.peer.do("subscribe", "/left/there", type="std_msgs/Int64")
    scene.until(lambda graph: bridge in graph.subscribers.get("/left/there", ()))
    scene.peer.do("close", "/left/there")
    scene.until(lambda graph: bridge not in graph.subscribers.get("/left/there", ()))
    scene.end(publisher)

    subscription, came = scene.subscribe("/left/back")
    scene.peer.do("publish", "/left/back", type="std_msgs/Int64", data="000100000500000000000000")
    assert came.get(timeout=LIMIT) == b"\5" + bytes(7)
    scene.end(subscription)
    scene.until(lambda graph: bridge not in graph.publishers.get("/left/back", ()))
    scene.peer.do("close", "/left/back")


def test_no_message_returns_if_both_sides_publish_and_subscribe(scene: Scene) -> None:
    bridge = "/minirospy_ros2_bridge"
    topic = "/both"
    publisher = scene.advertise(topic, "std_msgs/Int8")
    subscription, came = scene.subscribe(topic)
    scene.peer.do("subscribe", topic, type="std_msgs/Int8")
    # Its publisher is connected only to its own subscriber.
    scene.peer.do("publish", topic, type="std_msgs/Int8", data="0001000007")
    scene.until(
        lambda graph: bridge in graph.subscribers.get(topic, ()) and bridge in graph.publishers.get(topic, ())
    )

    # Wait until both directions work, and ignore the messages sent before.
    _until_received(
        came, b"\1", lambda: scene.peer.do("publish", topic, type="std_msgs/Int8", data="0001000001")
    )
    while not scene.peer.has_said(topic, b"\2"):
        scene.publish(publisher, b"\2")

    # Send one more message from each side, and then a last one: each message in between must have arrived once.
    scene.publish(publisher, b"\3")
    scene.publish(publisher, b"\4")
    received = []
    while not received or received[-1] != 4:
        received.append(scene.peer.message(topic)[0])
    assert received.count(3) == 1
    scene.peer.do("publish", topic, type="std_msgs/Int8", data="0001000005")
    scene.peer.do("publish", topic, type="std_msgs/Int8", data="0001000006")
    values = []
    while not values or values[-1] != 6:
        values.append(came.get(timeout=LIMIT)[0])
    assert values.count(5) == 1
    # Messages from ROS 1 reached ROS 1's own subscriber directly, and did not return from ROS 2.
    assert values.count(3) <= 1
    scene.end(subscription)


def _until_received(came: queue.Queue[bytes], value: bytes, send: Callable[[], None]) -> None:
    """Send repeatedly until the value is received, because messages sent before the endpoints are connected are lost."""
    while True:
        send()
        with contextlib.suppress(queue.Empty):
            while came.get(timeout=1.0) != value:
                pass
            return


def test_a_node_of_ros2_that_restarts_is_bridged_again(scene: Scene) -> None:
    subscription, came = scene.subscribe("/again/back")
    publisher = scene.advertise("/again/there", "std_msgs/String", latch=True)
    scene.publish(publisher, text("a"))
    for _ in range(2):
        peer = Peer(scene.environment)
        try:
            peer.do("publish", "/again/back", type="std_msgs/String", data="000100000200000062000000")
            assert came.get(timeout=LIMIT) == text("b")
            peer.do("subscribe", "/again/there", type="std_msgs/String", latched=True)
            assert peer.message("/again/there") == b"\2\0\0\0a\0\0\0"
        finally:
            peer.close()
        scene.until(lambda graph: "/again/back" not in graph.publishers)
    scene.end(subscription)
    scene.end(publisher)


def test_messages_of_a_best_effort_publisher_come(scene: Scene) -> None:
    data = sample("sensor_msgs/Imu")
    cdr = bytes(get_typestore(Stores.ROS2_JAZZY).ros1_to_cdr(data, "sensor_msgs/msg/Imu"))
    subscription, came = scene.subscribe("/imu")
    # The first messages may be lost.
    publish = partial(
        scene.peer.do, "publish", "/imu", type="sensor_msgs/Imu", reliable=False, data=cdr.hex()
    )
    _until_received(came, bytes(4) + data[4:], publish)
    scene.end(subscription)
    scene.peer.do("close", "/imu")


def test_a_rule_for_messages_passes_the_fields_that_it_names(scene: Scene) -> None:
    publisher = scene.advertise("/ruled", "rospy_tutorials/HeaderString", latch=True)
    scene.publish(publisher, sample("std_msgs/Header") + text("abc"))
    scene.peer.do("subscribe", "/ruled", type="diagnostic_msgs/KeyValue", latched=True)
    assert scene.peer.message("/ruled") == b"\1\0\0\0\0\0\0\0" + b"\4\0\0\0abc\0"
    scene.end(publisher)
    scene.peer.do("close", "/ruled")


def test_the_time_of_a_simulation_passes_both_ways(scene: Scene) -> None:
    time = (1_700_000_000).to_bytes(4, "little") + (500_000_000).to_bytes(4, "little")
    subscription, came = scene.subscribe("/clock")
    scene.peer.do("publish", "/clock", type="rosgraph_msgs/Clock", data="00010000" + time.hex())
    assert came.get(timeout=LIMIT) == time
    scene.end(subscription)
    scene.peer.do("close", "/clock")

    scene.peer.do("subscribe", "/clock", type="rosgraph_msgs/Clock", latched=True)
    publisher = scene.advertise("/clock", "rosgraph_msgs/Clock", latch=True)
    scene.publish(publisher, time)
    assert scene.peer.message("/clock") == time
    scene.end(publisher)
    scene.peer.do("close", "/clock")


def test_log_lines_pass_both_ways(scene: Scene) -> None:
    program = """
import rclpy
rclpy.init()
node = rclpy.create_node("talker")
node.create_timer(0.1, lambda: node.get_logger().warning("the battery is low"))
rclpy.spin(node)
"""
    subscription, came = scene.subscribe("/rosout")
    with running([str(PYTHON), "-c", program], scene.environment):
        line: Any = Log()
        while line.name != "talker":
            line = Log().deserialize(came.get(timeout=LIMIT))
    assert (line.level, line.msg) == (Log.WARN, "the battery is low")
    scene.end(subscription)

    publisher = scene.advertise("/rosout", "rosgraph_msgs/Log", latch=True)
    buffer = BytesIO()
    Log(level=Log.ERROR, name="/motor", msg="it is hot").serialize(buffer)
    scene.publish(publisher, buffer.getvalue())
    scene.peer.do("subscribe", "/rosout", type="rcl_interfaces/Log", latched=True)
    found = b""
    while b"/motor" not in found:
        found = scene.peer.message("/rosout")
    # The level follows the time; ERROR is 40 in ROS 2.
    assert found[8] == 40
    assert b"it is hot" in found
    scene.end(publisher)
    scene.peer.do("close", "/rosout")


def test_list_shows_pairs_and_reasons(scene: Scene) -> None:
    scene.advertise("/listed", "std_msgs/Time")
    scene.peer.do("subscribe", "/listed", type="std_msgs/Float32")
    scene.peer.do("serve", "/listed_service", type="std_srvs/SetBool", fields={})
    words = ["ros2-bridge", "--list", "--topics", "/listed", "--services", "/listed*"]
    code = f"import sys; from minirospy.cli.main import main; sys.exit(main({words}))"
    done = subprocess.run(
        [str(PYTHON), "-c", code],
        env=scene.environment,
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == (
        "/listed  1 -> 2  ROS 1 std_msgs/Time  ROS 2 std_msgs/Float32  "
        "not bridged: no rule makes [std_msgs/Time] a [std_msgs/Float32]: write one for --rules\n"
        "/listed_service  service  1 -> 2  ROS 1 std_srvs/SetBool  ROS 2 std_srvs/SetBool\n"
    )


# --- services

# A service with a string in its request, and a string in addition to ``success`` in its response.
ADD = "diagnostic_msgs/AddDiagnostics"


def text(value: str) -> bytes:
    return len(value).to_bytes(4, "little") + value.encode()


def test_a_server_of_ros2_is_called_from_ros1(scene: Scene) -> None:
    scene.peer.do("serve", "/there", type=ADD, fields={"success": True, "message": "got {}"})
    scene.until(lambda graph: "/there" in graph.services)
    assert scene.call("/there", ADD, text("a")) == [b"\1" + text("got a")]
    numbers = [str(number) for number in range(300)]
    assert scene.call("/there", ADD, *map(text, numbers)) == [
        b"\1" + text(f"got {number}") for number in numbers
    ]

    (refused,) = scene.call("/there", "std_srvs/Empty", b"")
    assert "md5sums do not match" in str(refused)
    scene.peer.do("close", "/there")
    scene.until(lambda graph: "/there" not in graph.services)


def test_the_first_call_waits_until_the_server_has_found_the_bridge(scene: Scene, tmp_path: Path) -> None:
    """rmw_fastrtps drops the response to a client whose reader it has not discovered yet."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler")
    library, hold = tmp_path / "late_discovery.so", tmp_path / "hold"
    source = HERE / "late_discovery.c"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    late = {"LD_PRELOAD": library, "LATE_DISCOVERY": hold, "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
    environment = {**scene.environment, **{name: str(value) for name, value in late.items()}}
    other = Peer(environment, [str(PYTHON), str(HERE / "ros2_peer.py"), "late_peer"])
    try:
        # The two processes have discovered each other; only the client of a further service is new.
        other.do("serve", "/early", type=ADD, fields={"success": True})
        scene.until(lambda graph: "/early" in graph.services)
        assert scene.call("/early", ADD, text("a")) == [b"\1" + text("")]

        hold.touch()
        other.do("serve", "/late", type=ADD, fields={"success": True})
        scene.until(lambda graph: "/late" in graph.services)
        results: queue.Queue[list[bytes | BaseException]] = queue.Queue()
        calling = threading.Thread(target=lambda: results.put(scene.call("/late", ADD, text("b"))))
        calling.start()
        with pytest.raises(queue.Empty):
            other.wait(lambda each: each["op"] == "request" and each["topic"] == "/late", limit=3.0)
        hold.unlink()
        assert results.get(timeout=LIMIT) == [b"\1" + text("")]
        calling.join()
    finally:
        other.close()


def test_a_call_of_ros1_ends_with_the_server_of_ros2(scene: Scene) -> None:
    other = Peer(scene.environment)
    try:
        other.do("serve", "/leaves", type=ADD, fields={}, silent=True)
        scene.until(lambda graph: "/leaves" in graph.services)
        results: queue.Queue[list[bytes | BaseException]] = queue.Queue()
        calling = threading.Thread(
            target=lambda: results.put(scene.call("/leaves", ADD, text("a"), text("b")))
        )
        calling.start()
        for _ in range(2):
            other.wait(lambda each: each["op"] == "request")
    finally:
        other.close()
    for error in results.get(timeout=LIMIT):
        assert "has ended during the call" in str(error)
    calling.join()


def test_a_server_of_ros1_is_called_from_ros2(scene: Scene) -> None:
    def answer(request: bytes) -> bytes:
        if request == text("bad"):
            raise ServiceException("not this one")
        return b"\1" + text("got " + request[4:].decode())

    server = scene.serve("/back", ADD, answer)
    scene.peer.do("call", "/back", type=ADD, fields=[{"load_namespace": "a"}])
    assert scene.peer.answer("/back") == {"success": "True", "message": "got a"}
    numbers = [str(number) for number in range(300)]
    scene.peer.do("call", "/back", type=ADD, fields=[{"load_namespace": number} for number in numbers])
    assert {scene.peer.answer("/back")["message"] for _ in numbers} == {f"got {each}" for each in numbers}

    # A response with a string field reports the reason.
    scene.peer.do("call", "/back", type=ADD, fields=[{"load_namespace": "bad"}])
    refused = scene.peer.answer("/back")
    assert refused["success"] == "False"
    assert "not this one" in refused["message"]
    scene.end(server)
    scene.peer.do("close", "/back")


def test_a_failure_that_a_response_cannot_name_is_in_the_log_of_ros2(scene: Scene) -> None:
    def answer(request: bytes) -> bytes:
        raise ServiceException("broken")

    server = scene.serve("/empty", "std_srvs/Empty", answer)
    scene.peer.do("subscribe", "/rosout", type="rcl_interfaces/Log", latched=True)
    scene.peer.do("call", "/empty", type="std_srvs/Empty", fields=[{}])
    line = b""
    while b"service [/empty] of ROS 1: service [/empty] responded with an error: broken" not in line:
        line = scene.peer.message("/rosout")
    scene.end(server)
    for name in ("/empty", "/rosout"):
        scene.peer.do("close", name)


def test_a_service_with_nested_types_passes_byte_by_byte(scene: Scene) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    path, pose = sample("nav_msgs/Path"), sample("geometry_msgs/PoseStamped")
    asked: list[bytes] = []

    def answer(request: bytes) -> bytes:
        asked.append(request)
        return path

    server = scene.serve("/plan", "nav_msgs/GetPlan", answer)
    cdr = bytes(store.ros1_to_cdr(pose, "geometry_msgs/msg/PoseStamped"))
    # Two poses: the second follows the end of the first, aligned to a float64.
    two = cdr + bytes(-(len(cdr) - 4) % 4) + cdr[4:] + bytes(-(len(cdr) - 4) % 4) + b"\0\0\0\x3f"
    scene.peer.do("call_raw", "/plan", type="nav_msgs/GetPlan", data=two.hex())
    found = scene.peer.wait(lambda each: each["op"] == "answer")
    expected = bytes(store.ros1_to_cdr(path, "nav_msgs/msg/Path"))
    assert bytes.fromhex(found["data"]) == expected
    assert asked[0][-4:] == b"\0\0\0\x3f"
    scene.end(server)
    scene.peer.do("close", "/plan")


# --- parameters


def test_parameters_of_ros1_are_those_of_the_bridge_in_ros2(scene: Scene) -> None:
    bridge = "/minirospy_ros2_bridge"

    def call(service: str, **fields: Any) -> dict[str, str]:
        type_ = "rcl_interfaces/" + service.title().replace("_", "")
        scene.peer.do("call", f"{bridge}/{service}", type=type_, fields=[fields])
        return scene.peer.answer(f"{bridge}/{service}")

    async def set_up() -> None:
        await scene.node.set_param("/robot", {"speed": 1.5, "name": "r2", "ids": [1, 2], "on": True})

    scene.run(set_up())
    listed = call("list_parameters", prefixes=["robot"])["result"]
    assert "names=['robot.ids', 'robot.name', 'robot.on', 'robot.speed'], prefixes=['robot']" in listed
    values = call("get_parameters", names=["robot.speed", "robot.name", "robot.none"])["values"]
    assert "type=3" in values
    assert "double_value=1.5" in values
    assert "string_value='r2'" in values
    assert values.count("type=0") == 1
    assert call("get_parameter_types", names=["robot.ids"])["types"] in ("array('B', [7])", "b'\\x07'")

    parameter = {"name": "robot.speed", "value": {"type": 2, "integer_value": 3}}
    assert "successful=True" in call("set_parameters", parameters=[parameter])["results"]
    assert scene.run(scene.node.get_param("/robot/speed")) == 3
    parameter["value"] = {"type": 2, "integer_value": 2**40}
    refused = call("set_parameters_atomically", parameters=[parameter])["result"]
    assert "successful=False" in refused
    assert "does not fit into the 32 bits" in refused


def test_parameters_of_ros2_are_reached_by_services_of_ros1(scene: Scene) -> None:
    scene.peer.do("declare", "gain", value=0.5)
    bridge = "/minirospy_ros2_bridge"

    def call(service: str, type_: str, *texts: str) -> bytes:
        (response,) = scene.call(f"{bridge}/{service}", type_, b"".join(map(text, texts)))
        if isinstance(response, BaseException):
            raise response
        return response

    names = call("get_param_names", "rosapi/GetParamNames")
    assert text("/peer:gain") in names
    assert call("get_param", "rosapi/GetParam", "/peer:gain", "") == text("0.5")
    assert call("set_param", "rosapi/SetParam", "/peer:gain", "0.75") == b""
    assert call("get_param", "rosapi/GetParam", "/peer:gain", "") == text("0.75")
    assert call("get_param", "rosapi/GetParam", "/peer:none", "7") == text("7")
    with pytest.raises(ServiceException, match=r"refuses \[none\]"):
        call("set_param", "rosapi/SetParam", "/peer:none", "1")
    with pytest.raises(ServiceException, match="write /node:parameter"):
        call("get_param", "rosapi/GetParam", "gain", "")


# --- actions

FIBONACCI = "test_msgs/Fibonacci"


def test_goals_of_ros1_reach_a_server_of_ros2(scene: Scene) -> None:
    scene.peer.do("act", "/count", type=FIBONACCI)
    scene.peer.do("act", "/wait", type=FIBONACCI, waits=True)

    async def count() -> None:
        async with ActionClient(scene.node, "/count", FibonacciAction) as client:
            await client.wait_for_server()
            goal = client.send(FibonacciGoal(order=5))
            feedback = [list(each.sequence) async for each in goal]
            assert feedback == [list(range(number + 1)) for number in range(5)]
            assert list((await goal).sequence) == [0, 1, 2, 3, 4]
            assert await ended(client.send(FibonacciGoal(order=-1))) == (GoalState.REJECTED, [])
            assert await ended(client.send(FibonacciGoal(order=13))) == (GoalState.ABORTED, list(range(13)))
            goals = [client.send(FibonacciGoal(order=number)) for number in range(8)]
            for number, goal in enumerate(goals):
                assert list((await goal).sequence) == list(range(number))

    async def cancel() -> None:
        async with ActionClient(scene.node, "/wait", FibonacciAction) as client:
            await client.wait_for_server()
            goal = client.send(FibonacciGoal(order=3))
            # The goal is active now.
            async for feedback in goal:
                if len(feedback.sequence) == 3:
                    break
            goal.cancel()
            assert await ended(goal) == (GoalState.PREEMPTED, [0, 1, 2])

    scene.run(count())
    scene.run(cancel())
    for name in ("/count", "/wait"):
        scene.peer.do("close", name)
    scene.until(lambda graph: "/count/result" not in graph.publishers)


async def ended(goal: Any) -> tuple[GoalState, list[int]]:
    """Return the final state and the feedback of a goal that was not reached."""
    with pytest.raises(GoalError) as caught:
        await goal
    return caught.value.state, list(getattr(caught.value.result, "sequence", []))


def test_a_goal_of_ros1_is_aborted_when_its_server_in_ros2_ends(scene: Scene) -> None:
    other = Peer(scene.environment)
    try:
        other.do("act", "/leaving", type=FIBONACCI, waits=True)

        async def start() -> tuple[Any, Any]:
            client = ActionClient(scene.node, "/leaving", FibonacciAction)
            await client.wait_for_server()
            goal = client.send(FibonacciGoal(order=1))
            await until(lambda: goal.state is GoalState.ACTIVE or goal.state in TERMINAL)
            assert goal.state is GoalState.ACTIVE, goal.text
            return client, goal

        client, goal = scene.run(start())
        other.wait(lambda each: each["op"] == "request")
    finally:
        other.close()

    async def end() -> None:
        state, _ = await ended(goal)
        assert state is GoalState.ABORTED
        assert "in ROS 2 has ended" in goal.text
        await client.close()

    scene.run(end())


def test_goals_of_ros2_reach_a_server_of_ros1(scene: Scene) -> None:
    async def execute(goal: Any) -> dict[str, list[int]]:
        sequence: list[int] = []
        for number in range(goal.request.order):
            sequence.append(number)
            await goal.publish_feedback(sequence)
        if goal.request.order == 13:
            raise GoalError("unlucky", {"sequence": sequence})
        if goal.request.order == 7:
            try:
                await asyncio.sleep(LIMIT)
            except asyncio.CancelledError:
                return {"sequence": sequence}
        return {"sequence": sequence}

    async def start() -> Any:
        return await ActionServer(
            scene.node, "/back/count", FibonacciAction, execute, accepts=lambda goal: goal.order >= 0
        )

    def end_of(order: int, *, is_cancelled: bool = False) -> tuple[int, list[int]]:
        scene.peer.do("goal", "/back/count", type=FIBONACCI, fields={"order": order})
        assert scene.peer.wait(lambda each: each["op"] == "accepted")["is_accepted"] == (order >= 0)
        if order < 0:
            return 0, []
        if is_cancelled:
            for number in range(order):
                feedback = scene.peer.wait(lambda each: each["op"] == "feedback")
                assert feedback["data"] == list(range(number + 1))
            scene.peer.do("cancel", "/back/count")
        found = scene.peer.wait(lambda each: each["op"] == "end")
        return found["status"], found["data"]

    server = scene.run(start())
    # All feedback for an active goal arrives; rclpy itself drops feedback that it has not read when the result
    # arrives.
    assert end_of(7, is_cancelled=True) == (5, list(range(7)))
    assert end_of(5) == (4, [0, 1, 2, 3, 4])
    assert end_of(-1) == (0, [])
    assert end_of(13) == (6, list(range(13)))
    scene.end(server)
    scene.peer.do("close", "/back/count")


def test_a_goal_of_ros2_is_aborted_when_the_bridge_ends(tmp_path: Path) -> None:
    async def execute(goal: Any) -> dict[str, list[int]]:
        await goal.publish_feedback([1])
        await asyncio.sleep(LIMIT)
        return {}

    with running_scene(tmp_path) as (scene, bridge):

        async def start() -> Any:
            return await ActionServer(scene.node, "/endless", FibonacciAction, execute)

        scene.run(start())
        scene.peer.do("goal", "/endless", type=FIBONACCI, fields={"order": 7})
        assert scene.peer.wait(lambda each: each["op"] == "accepted")["is_accepted"]
        assert scene.peer.wait(lambda each: each["op"] == "feedback")["data"] == [1]
        bridge.terminate()
        assert scene.peer.wait(lambda each: each["op"] == "end")["status"] == 6
        # The bridge is not interrupted a second time during shutdown.
        assert bridge.wait(LIMIT) == 0


# --- the page


def example(name: str, folder: Path) -> str:
    """Write a program from docs/ros2.md to a file, and return its path."""
    page = (HERE.parents[1] / "docs" / "ros2.md").read_text(encoding="utf-8")
    block = page.partition(f"<!-- example {name} -->\n")[2]
    lines = itertools.takewhile(lambda line: not line or line.startswith("    "), block.split("\n"))
    file = folder / name
    file.write_text(textwrap.dedent("\n".join(lines)))
    return str(file)


def command(name: str) -> list[str]:
    """Return the command that is on a separate line in docs/ros2.md."""
    page = (HERE.parents[1] / "docs" / "ros2.md").read_text(encoding="utf-8")
    (line,) = [line for line in page.split("\n") if line.startswith(f"    {name}")]
    words = shlex.split(line)
    return [str(OUR_BIN / words[0]), *words[1:]]


@contextlib.contextmanager
def running(words: list[str], environment: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    program = subprocess.Popen(
        words, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    # Killing a program that prints nothing ends the wait for its output.
    limit = threading.Timer(LIMIT, program.kill)
    limit.start()
    with program:
        try:
            yield program
        finally:
            limit.cancel()
            program.kill()


def test_examples_of_the_page_run_as_described(scene: Scene, tmp_path: Path) -> None:
    def line_of(program: subprocess.Popen[str]) -> str:
        assert program.stdout
        return program.stdout.readline().strip()

    environment = scene.environment
    with (
        running(command("rostopic pub"), environment),
        running([str(PYTHON), example("battery.py", tmp_path)], environment) as battery,
    ):
        assert line_of(battery) == "50%"
    with (
        running([str(PYTHON), example("drive.py", tmp_path)], environment),
        running([sys.executable, example("base.py", tmp_path)], environment) as base,
    ):
        assert line_of(base) == "0.2 m/s"
    with (
        running([sys.executable, example("motors.py", tmp_path)], environment),
        running([str(PYTHON), example("switch.py", tmp_path)], environment) as switch,
    ):
        assert line_of(switch) == "on"
