"""Driving through the server's endpoint: however a client fails, the last message is zero velocity."""

from __future__ import annotations

import base64
import json
import os
import re
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast
from xmlrpc.client import ServerProxy

import pytest
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from minirospy.base.name_filter import NameFilter
from minirospy.runtime.stop_guard import StopGuard
from minirospy.web.access import Access
from minirospy.web.dashboard.drive_endpoint import (
    SUBPROTOCOL,
    Command,
    DriveSession,
    Joystick,
    Target,
    Velocity,
    parse,
)
from minirospy.web.graph import Filters

if TYPE_CHECKING:
    from minirospy.web.graph import SharedGraph
    from tests.web.dashboard.conftest import Served

FORWARD = {"topic": "/cmd_vel", "twist": [0.5, 0, 0, 0, 0, -1]}
REACH = {"topic": "/arm/command", "joints": ["a", "b"], "positions": [0.5, -1], "seconds": 2}
AT_REST = {"topic": "/cmd_vel", "twist": [0] * 6}


# --- commands


def test_commands_are_parsed() -> None:
    assert parse(json.dumps(FORWARD)) == Command("/cmd_vel", Velocity((0.5, 0, 0, 0, 0, -1)))
    assert parse('{"topic": "joy", "axes": [0.5], "buttons": [0, 1]}') == Command(
        "joy", Joystick((0.5,), (0, 1))
    )
    assert parse(json.dumps(REACH)) == Command("/arm/command", Target(("a", "b"), (0.5, -1), 2.0))
    assert parse('{"leave": "/joy"}') == Command("/joy", None)
    assert Velocity((0.0, -0.0, 0, 0, 0, 0)).is_zero
    assert Joystick((0.0, 1.0), (1,)).zero() == Joystick((0.0, 0.0), (0,))
    assert not Joystick((0.0,), (1,)).is_zero
    assert Target(("a",), (0.0,), 1.0).zero().is_zero
    assert not Target(("a",), (0.0,), 1.0).is_zero


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "Expecting value"),
        ("[]", "not an object"),
        ("{}", "it has nothing"),
        ('{"topic": "/a", "twist": [1]}', "a twist has 6 numbers"),
        ('{"topic": "/a", "twist": [1, 2, 3, 4, 5, NaN]}', "not finite"),
        ('{"topic": "/a", "twist": [1, 2, 3, 4, 5, "6"]}', "not finite"),
        ('{"topic": "/a", "twist": [1, 2, 3, 4, 5, 1' + "0" * 400 + "]}", "not finite"),
        ('{"topic": "/a b", "twist": [1, 2, 3, 4, 5, 6]}', "topic [/a b]"),
        ('{"topic": 1, "twist": [1, 2, 3, 4, 5, 6]}', "a topic is a name"),
        ('{"topic": "/a", "axes": [], "buttons": [1e12]}', "a button is 0 or 1"),
        (json.dumps({"topic": "/a", "axes": [0] * 101, "buttons": []}), "an array, of 100 at most"),
        ("[" * 20_000, "nested too deep"),
        ("[" * 20_001, "more than 20000 characters"),
        ('{"topic": "/a", "axes": [1e39], "buttons": []}', "an axis is from -1 to 1"),
        (json.dumps(REACH | {"joints": []}), "joints are an array of names"),
        (json.dumps(REACH | {"joints": [1, 2]}), "joints are an array of names"),
        (json.dumps(REACH | {"joints": ["a"]}), "each joint has one position"),
        (json.dumps(REACH | {"positions": [0, float("nan")]}), "not finite"),
        (json.dumps(REACH | {"seconds": 0}), "a motion lasts up to 3600 seconds"),
        (json.dumps(REACH | {"seconds": 3601}), "a motion lasts up to 3600 seconds"),
        (json.dumps(REACH | {"seconds": None}), "not finite"),
    ],
)
def test_text_that_is_not_a_command_is_refused(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=re.escape(why)):
        parse(text)


# --- a robot that listens


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a topic wait for its subscribers for as long as a busy machine needs."""
    monkeypatch.setattr("minirospy.aio.topics.JOIN_SECONDS", 60.0)


@pytest.fixture
def robot(serve: Callable[..., Served]) -> tuple[Served, Callable[..., Any]]:
    """Return a dashboard, and a function that returns the next message on /cmd_vel that fulfils a condition."""
    served = serve()
    return served, listen(served)


def listen(served: Served, topic: str = "/cmd_vel", cls: type = Twist) -> Callable[..., Any]:
    node = served.node("robot" + topic.replace("/", "_"))

    async def start() -> Any:
        return await node.subscribe(topic, cls)

    subscription = served.run(start())

    def until(is_right: Callable[[Any], bool]) -> Any:
        while not is_right(message := served.run(subscription.next(50))):
            pass
        return message

    return until


def opened(served: Served, token: str = "") -> Any:
    names = [Subprotocol(SUBPROTOCOL)] + ([Subprotocol(f"minirospy.token.{token}")] if token else [])
    return connect(f"ws://127.0.0.1:{served.port}/", subprotocols=names, compression=None, open_timeout=100)


def moves(twist: Twist) -> bool:
    return (twist.linear.x, twist.angular.z) == (0.5, -1)


def is_zero(twist: Twist) -> bool:
    return not twist.linear.x and not twist.angular.z


class RawClient:
    """A client whose connection can be cut: a plain socket, without a WebSocket close."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), 60)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            f"GET / HTTP/1.1\r\nHost: localhost:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            f"Sec-WebSocket-Protocol: {SUBPROTOCOL}\r\n\r\n".encode()
        )
        answer = b""
        while b"\r\n\r\n" not in answer:
            answer += self.socket.recv(4096)
        assert b" 101 " in answer.split(b"\r\n")[0]

    def send(self, fields: object) -> None:
        data = json.dumps(fields).encode()
        assert len(data) < 126
        self.socket.sendall(bytes((0x81, 0x80 | len(data))) + b"\0\0\0\0" + data)


def move(client: RawClient, until: Callable[..., Any]) -> None:
    """Drive until a message arrives; first connect the topic, which may take longer than a client may be silent."""
    client.send(AT_REST)
    until(is_zero)
    client.send(FORWARD)
    until(moves)


def test_held_control_publishes_velocity_and_release_publishes_zero(robot: Any) -> None:
    served, until = robot
    with opened(served) as client:
        assert json.loads(client.recv(timeout=60)) == {"writes": True}
        client.send(json.dumps(AT_REST))
        until(is_zero)
        client.send(json.dumps(FORWARD))
        until(moves)
        client.send(json.dumps(AT_REST))
        until(is_zero)


@pytest.mark.parametrize("ending", ["closes", "is cut off", "is reset"])
def test_robot_stops_when_the_client(robot: Any, ending: str) -> None:
    served, until = robot
    client = RawClient(served.port)
    move(client, until)
    if ending == "closes":
        client.socket.sendall(bytes((0x88, 0x80, 0, 0, 0, 0)))
    if ending == "is reset":
        client.socket.setsockopt(
            socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("hh" if sys.platform == "win32" else "ii", 1, 0)
        )
    client.socket.close()
    until(is_zero)


def test_robot_stops_when_the_client_is_silent_and_moves_again(robot: Any) -> None:
    served, until = robot
    with opened(served) as client:
        client.recv(timeout=60)
        client.send(json.dumps(AT_REST))
        until(is_zero)
        for _ in range(2):
            client.send(json.dumps(FORWARD))
            until(moves)
            # The connection is open, but no data arrives, as from a page that hangs or through a pulled cable.
            until(is_zero)
            assert json.loads(client.recv(timeout=60)) == {"stopped": "/cmd_vel"}


CLIENT = """
import json, sys, time
from websockets.sync.client import connect
with connect(sys.argv[1], subprotocols=["minirospy.drive.v1"]) as client:
    while True:
        client.send(sys.argv[2])
        time.sleep(0.05)
"""


def test_robot_stops_when_the_process_of_the_client_is_killed(robot: Any) -> None:
    served, until = robot
    words = [f"ws://127.0.0.1:{served.port}/", json.dumps(FORWARD)]
    process = subprocess.Popen([sys.executable, "-c", CLIENT, *words])
    try:
        until(moves)
    finally:
        process.kill()
        process.wait()
    until(is_zero)


def test_robot_stops_when_the_dashboard_is_closed(serve: Callable[..., Served]) -> None:
    served = serve()
    until = listen(served)
    client = RawClient(served.port)
    move(client, until)
    assert served.dashboard
    served.run(served.dashboard.close())
    until(is_zero)
    client.socket.close()


class RawSubscriber:
    """A robot with a separate thread: it subscribes to the dashboard's node by XML-RPC and TCPROS."""

    def __init__(self, served: Served, topic: str) -> None:
        with ServerProxy(served.node_of_dashboard.uri) as node:
            answer: Any = node.requestTopic("/raw", topic, [["TCPROS"]])
        _, host, port = answer[2]
        self.socket = socket.create_connection((host, port), 60)
        fields = {"callerid": "/raw", "topic": topic, "type": Twist._type, "md5sum": Twist._md5sum}
        parts = [f"{name}={value}".encode() for name, value in fields.items()]
        header = b"".join(struct.pack("<I", len(part)) + part for part in parts)
        self.socket.sendall(struct.pack("<I", len(header)) + header)
        self.read()

    def read(self) -> bytes:
        """Return the next frame."""
        (size,) = struct.unpack("<I", self._exactly(4))
        return self._exactly(size)

    def until(self, is_right: Callable[[Any], bool]) -> None:
        while not is_right(Twist().deserialize(self.read())):
            pass

    def _exactly(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            more = self.socket.recv(size - len(data))
            assert more
            data += more
        return data


@pytest.mark.parametrize("is_lost", [False, True])
def test_robot_stops_while_the_loop_of_the_server_is_blocked(robot: Any, is_lost: bool) -> None:
    served, until = robot
    client = RawClient(served.port)
    client.send(AT_REST)
    until(is_zero)
    subscriber = RawSubscriber(served, "/cmd_vel")
    client.send(FORWARD)
    subscriber.until(moves)

    released, blocked = threading.Event(), threading.Event()

    def block() -> None:
        blocked.set()
        released.wait()

    served.loop.loop.call_soon_threadsafe(block)
    try:
        assert blocked.wait(60)
        if is_lost:
            client.socket.close()
        subscriber.until(is_zero)
    finally:
        released.set()
    if not is_lost:
        # The client drives again as soon as its commands are read again.
        client.send(FORWARD)
        subscriber.until(moves)
        client.socket.close()
        subscriber.until(is_zero)
    subscriber.socket.close()


def test_client_that_leaves_before_its_topic_is_connected_leaves_a_zero(robot: Any) -> None:
    served, until = robot
    client = RawClient(served.port)
    client.send(FORWARD)
    client.socket.close()
    until(is_zero)


def test_joystick_is_published_and_at_rest_when_it_is_left(serve: Callable[..., Served]) -> None:
    served = serve()
    until = listen(served, "/joy", Joy)
    with opened(served) as client:
        client.send('{"topic": "/joy", "axes": [0, 0], "buttons": [0, 0, 0]}')
        until(lambda joy: joy.axes[0] == 0)
        client.send('{"topic": "/joy", "axes": [0.5, -1], "buttons": [1, 0, 1]}')
        held = until(lambda joy: joy.axes[0] == 0.5)
        assert list(held.buttons) == [1, 0, 1]
        assert held.header.stamp.to_sec() > 0
        client.send('{"leave": "/joy"}')
        rest = until(lambda joy: joy.axes[0] == 0)
        assert (list(rest.axes), list(rest.buttons)) == ([0, 0], [0, 0, 0])


@pytest.mark.parametrize("ending", ["leaves", "is silent", "is cut off"])
def test_joints_are_held_when_the_client(serve: Callable[..., Served], ending: str) -> None:
    served = serve()
    until = listen(served, "/arm/command", JointTrajectory)
    with opened(served) as client:
        # The topic is connected first, which may take longer than a client may be silent.
        client.send(json.dumps(REACH))
        until(lambda command: not command.points or command.points[0].positions)
        client.send(json.dumps(REACH))
        reached = until(lambda command: command.points)
        assert list(reached.joint_names) == ["a", "b"]
        assert list(reached.points[0].positions) == [0.5, -1]
        assert reached.points[0].time_from_start.to_sec() == 2
        assert reached.header.stamp.to_sec() > 0
        if ending == "leaves":
            client.send('{"leave": "/arm/command"}')
        elif ending == "is cut off":
            client.socket.close()
        until(lambda command: not command.points)


def test_forbidden_topics_are_named(serve: Callable[..., Served]) -> None:
    access = Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    served = serve(access=access, filters=Filters(publishable=NameFilter(allow=("/cmd_*",))))
    node = served.node("talker")

    async def advertise() -> Any:
        return await node.advertise("/cmd_chatter", String)

    served.run(advertise())
    with opened(served, "read-token-00") as client:
        assert json.loads(client.recv(timeout=60)) == {"writes": False}
        client.send(json.dumps(FORWARD))
        assert "read-only" in json.loads(client.recv(timeout=60))["error"]
    with opened(served, "write-token-0") as client:
        client.recv(timeout=60)
        client.send(json.dumps({"topic": "/arm", "twist": [0] * 6}))
        assert json.loads(client.recv(timeout=60)) == {
            "error": "topic [/arm] may not be published by clients",
            "topic": "/arm",
        }
        client.send("{}")
        assert "not a command of driving: it has nothing" in json.loads(client.recv(timeout=60))["error"]
        client.send(b"1")
        assert "binary" in json.loads(client.recv(timeout=60))["error"]


def test_all_topics_are_stopped_if_one_fails() -> None:
    closed: list[str] = []

    class Driven:
        def __init__(self, topic: str) -> None:
            self.topic = topic

        def close(self) -> None:
            closed.append(self.topic)
            if self.topic == "/a":
                raise OSError("gone")

    client: Any = SimpleNamespace(may_write=True, send_text=lambda _: None)
    session = DriveSession(client, cast("SharedGraph", None), StopGuard())
    session._driven = {topic: cast("Any", Driven(topic)) for topic in ("/a", "/b")}
    session.ended()
    assert closed == ["/a", "/b"]
