"""`minirospy ros2-bridge --zenoh` with two independent implementations of rmw_zenoh's protocol, pyzeros and zenoh-ros2-sdk."""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

from minirospy.base.errors import ServiceException
from tests.conftest import free_port
from tests.interop.conftest import OUR_BIN, running_master
from tests.interop.install_zenoh_peers import CACHE, PYTHON, STAMP
from tests.interop.test_interop_ros2 import LIMIT, Peer, Scene, sample

HERE = Path(__file__).parent
pytestmark = [
    pytest.mark.skipif(not STAMP.exists(), reason="no peers of Zenoh: tests/interop/install_zenoh_peers.py"),
    pytest.mark.timeout(400),
]

TYPES = [
    "std_msgs/Bool", "std_msgs/ColorRGBA", "std_msgs/Float64", "std_msgs/Float64MultiArray", "std_msgs/Header",
    "std_msgs/Int64", "std_msgs/String", "std_msgs/UInt8MultiArray", "geometry_msgs/PointStamped",
    "geometry_msgs/PoseArray", "geometry_msgs/PoseWithCovarianceStamped", "geometry_msgs/TransformStamped",
    "geometry_msgs/Twist", "sensor_msgs/CameraInfo", "sensor_msgs/CompressedImage", "sensor_msgs/Image", "sensor_msgs/Imu",
    "sensor_msgs/JointState", "sensor_msgs/LaserScan", "sensor_msgs/PointCloud2", "nav_msgs/OccupancyGrid",
    "nav_msgs/Odometry", "diagnostic_msgs/DiagnosticArray",
]  # fmt: skip


class ZenohScene(Scene):
    """A scene with `minirospy fleet router`, the bridge, and the router's endpoint."""

    endpoint = ""

    def other(self, kind: str) -> Peer:
        """Start another peer."""
        return Peer(self.environment, command(kind, self.endpoint))


def command(kind: str, endpoint: str) -> list[str]:
    return [str(PYTHON), str(HERE / "zenoh_peer.py"), kind, endpoint]


@pytest.fixture(scope="module", params=["pyzeros", "sdk"])
def scene(request: pytest.FixtureRequest) -> Iterator[ZenohScene]:
    with contextlib.ExitStack() as parts:
        uri = parts.enter_context(running_master("ours"))
        endpoint = f"tcp/127.0.0.1:{free_port()}"
        environment = {
            **{name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
            "ROS_MASTER_URI": uri,
            "ROS_DOMAIN_ID": "7",
            "CYDR_CACHE_DIR": str(CACHE),
        }
        ours = str(OUR_BIN / "minirospy")
        router = subprocess.Popen(
            [ours, "fleet", "router", "--listen", endpoint], env=environment, stdout=subprocess.PIPE
        )
        parts.callback(lambda: ended(router))
        assert router.stdout
        assert endpoint.encode() in router.stdout.readline()
        bridge = subprocess.Popen([ours, "ros2-bridge", "--zenoh", "--connect", endpoint], env=environment)
        parts.callback(lambda: ended(bridge))
        found = ZenohScene(uri, environment, parts, command(request.param, endpoint))
        found.endpoint = endpoint
        yield found


def ended(program: subprocess.Popen[bytes]) -> None:
    program.terminate()
    assert program.wait(LIMIT) == 0
    if program.stdout:
        program.stdout.close()


def only(scene: ZenohScene, kind: str, request: pytest.FixtureRequest) -> None:
    if request.node.callspec.params["scene"] != kind:
        pytest.skip(f"of {kind} alone")


def test_messages_are_those_that_rosbags_converts(scene: ZenohScene, request: pytest.FixtureRequest) -> None:
    only(scene, "pyzeros", request)
    store = get_typestore(Stores.ROS2_JAZZY)
    there: list[tuple[str, bytes]] = []
    publishers = []
    for type_ in TYPES:
        data = sample(type_)
        topic = "/there/" + type_.replace("/", "_").lower()
        there.append((topic, bytes(store.ros1_to_cdr(data, type_.replace("/", "/msg/")))))
        scene.peer.do("subscribe", topic, type=type_)
        publisher = scene.advertise(topic, type_, latch=True)
        scene.publish(publisher, data)
        publishers.append(publisher)
    for topic, cdr in there:
        assert scene.peer.message(topic) == cdr[4:], topic

    subscriptions = []
    back: list[tuple[str, queue.Queue[bytes], bytes]] = []
    for type_, (name, cdr) in zip(TYPES, there, strict=True):
        topic = name.replace("/there/", "/back/")
        subscription, came = scene.subscribe(topic)
        subscriptions.append(subscription)
        back.append((topic, came, bytes(store.cdr_to_ros1(cdr, type_.replace("/", "/msg/")))))
        scene.peer.do("publish", topic, type=type_, data=cdr.hex())
    for topic, came, data in back:
        assert came.get(timeout=LIMIT) == data, topic
    for handle in (*subscriptions, *publishers):
        scene.end(handle)


def test_numbers_and_texts_pass_both_ways(scene: ZenohScene, request: pytest.FixtureRequest) -> None:
    only(scene, "sdk", request)
    text, number = b"\5\0\0\0hallo", (-5).to_bytes(8, "little", signed=True)
    for type_, data, value in (("std_msgs/String", text, "hallo"), ("std_msgs/Int64", number, -5)):
        name = type_.rpartition("/")[2].lower()
        scene.peer.do("subscribe", f"/there/{name}", type=type_)
        publisher = scene.advertise(f"/there/{name}", type_, latch=True)
        scene.publish(publisher, data)
        assert said(scene.peer, f"/there/{name}") == value
        subscription, came = scene.subscribe(f"/back/{name}")
        scene.peer.do("publish", f"/back/{name}", type=type_, value=value)
        assert came.get(timeout=LIMIT) == data
        scene.end(subscription)
        scene.end(publisher)


def said(peer: Peer, topic: str) -> Any:
    """Return the value of a topic's next message, as zenoh-ros2-sdk prints it."""
    return peer.wait(lambda each: each["op"] == "message" and each["topic"] == topic)["value"]


def test_late_subscriber_receives_latched_messages(scene: ZenohScene, request: pytest.FixtureRequest) -> None:
    # pyzeros does not support transient local durability.
    only(scene, "sdk", request)
    publisher = scene.advertise("/late", "std_msgs/String", latch=True)
    scene.publish(publisher, b"\4\0\0\0kept")
    scene.peer.do("subscribe", "/late", type="std_msgs/String", latched=True)
    assert said(scene.peer, "/late") == "kept"
    other = scene.other("sdk")
    try:
        other.do("subscribe", "/late", type="std_msgs/String", latched=True)
        assert said(other, "/late") == "kept"
    finally:
        other.close()
    scene.end(publisher)


def test_messages_are_not_sent_back(scene: ZenohScene, request: pytest.FixtureRequest) -> None:
    only(scene, "pyzeros", request)
    subscription, came = scene.subscribe("/both")
    scene.peer.do("publish", "/both", type="std_msgs/String", data="00010000020000006200")
    assert came.get(timeout=LIMIT) == b"\1\0\0\0b"
    scene.peer.do("subscribe", "/both", type="std_msgs/String")
    publisher = scene.advertise("/both", "std_msgs/String", latch=True)
    scene.publish(publisher, b"\1\0\0\0a")
    assert scene.peer.message("/both") == b"\2\0\0\0a\0"
    assert came.get(timeout=LIMIT) == b"\1\0\0\0a"
    scene.peer.do("publish", "/both", type="std_msgs/String", data="00010000020000006400")
    assert came.get(timeout=LIMIT) == b"\1\0\0\0d"
    assert scene.peer.message("/both") == b"\2\0\0\0d\0"
    # Another message follows on each side, which shows that nothing arrived twice.
    scene.publish(publisher, b"\1\0\0\0c")
    assert scene.peer.message("/both") == b"\2\0\0\0c\0"
    assert came.get(timeout=LIMIT) == b"\1\0\0\0c"
    scene.peer.do("close", "/both")
    scene.end(subscription)
    scene.end(publisher)


def test_a_node_that_restarts_is_bridged_again(scene: ZenohScene, request: pytest.FixtureRequest) -> None:
    kind = request.node.callspec.params["scene"]
    subscription, came = scene.subscribe("/again")
    for _ in range(2):
        peer = scene.other(kind)
        peer.do("publish", "/again", type="std_msgs/String", data="00010000020000006200", value="b")
        assert came.get(timeout=LIMIT) == b"\1\0\0\0b"
        peer.close()
        scene.until(lambda graph: "/again" not in graph.publishers)
    scene.end(subscription)


def test_services_pass_both_ways(scene: ZenohScene) -> None:
    def answer(request: bytes) -> bytes:
        if request == b"\0":
            raise ServiceException("the motor is hot")
        return b"\1\2\0\0\0on"

    service = scene.serve("/motors", "std_srvs/SetBool", answer)
    scene.peer.do("call", "/motors", type="std_srvs/SetBool", fields=[{"data": True}, {"data": False}])
    assert scene.peer.answer("/motors") == {"success": True, "message": "on"}
    failed = scene.peer.answer("/motors")
    assert not failed["success"]
    assert "the motor is hot" in failed["message"]
    scene.end(service)

    scene.peer.do("serve", "/lamp", type="std_srvs/SetBool", fields={"success": True, "message": "it is {}"})
    scene.until(lambda graph: "/lamp" in graph.services)
    assert scene.call("/lamp", "std_srvs/SetBool", b"\1", b"\0") == [
        b"\1\x0a\0\0\0it is True", b"\1\x0b\0\0\0it is False",
    ]  # fmt: skip
    scene.peer.do("close", "/lamp")
    scene.until(lambda graph: "/lamp" not in graph.services)


def test_the_list_shows_what_is_bridged(scene: ZenohScene) -> None:
    publisher = scene.advertise("/shown", "std_msgs/String")
    scene.peer.do("subscribe", "/shown", type="std_msgs/String")
    service = scene.serve("/shown_too", "std_srvs/SetBool", lambda _: b"\1\0\0\0\0")
    words = [str(OUR_BIN / "minirospy"), "ros2-bridge", "--zenoh", "--connect", scene.endpoint, "--list"]
    done = subprocess.run(
        words, env=scene.environment, capture_output=True, text=True, timeout=LIMIT, check=True
    )
    assert "/shown  1 -> 2  ROS 1 std_msgs/String  ROS 2 std_msgs/String\n" in done.stdout
    assert "/shown_too  service  2 -> 1  ROS 1 std_srvs/SetBool  ROS 2 std_srvs/SetBool\n" in done.stdout
    scene.peer.do("close", "/shown")
    scene.end(publisher)
    scene.end(service)
