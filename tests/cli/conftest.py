"""A small graph for command tests: one node that publishes, subscribes and serves."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from geometry_msgs.msg import Point32, PolygonStamped
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger

from minirospy.base.environment import Environment
from minirospy.base.errors import ServiceException
from minirospy.cli.registry import find_script, find_verb
from minirospy.core.wire.framing import serialize_frame
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.transport.loop import LoopThread

BIN = Path(sys.executable).parent


class Robot(NamedTuple):
    """The node, its loop, the messages received on /listen, and the reasons for shutdown requests."""

    node: Node
    loop: LoopThread
    heard: list[bytes]
    stopped: list[str]

    def publish(self, topic: str, message: Any) -> None:
        """Publish a latched message, which late subscribers also receive."""
        buffer = BytesIO()
        message.serialize(buffer)
        body = buffer.getvalue()
        self.node.publications[topic].publish(serialize_frame(body))


@pytest.fixture
def robot(master: str) -> Iterator[Robot]:
    """Run /robot, which publishes /button_state, /ns/chatter and /poly, subscribes to /listen, and offers two services."""
    loop = LoopThread("robot")
    stopped: list[str] = []
    heard: list[bytes] = []
    node = Node("/robot", Environment.read(), on_shutdown=stopped.append)
    loop.run(node.start())

    try:
        for topic, cls in (("/button_state", Bool), ("/ns/chatter", String), ("/poly", PolygonStamped)):
            type_ = InterfaceType(cls._type, cls._md5sum, cls._full_text)
            loop.run(node.advertise(Publication(topic, type_, latch=True)))
        listen = InterfaceType(Bool._type, Bool._md5sum, Bool._full_text)
        subscription = node.make_subscription("/listen", listen, lambda body, _: heard.append(bytes(body)))
        loop.run(node.subscribe(subscription))
        anything = node.make_subscription("/any", InterfaceType(ANY, ANY), lambda *_: None)
        loop.run(node.subscribe(anything))

        for name, srv, handler in (
            ("/set_led_state", SetBool, _set_led_state),
            ("/fail", Trigger, _fail),
        ):
            server = node.make_service(
                name,
                InterfaceType(srv._type, srv._md5sum),
                handler,
                request_type=srv._request_class._type,
                response_type=srv._response_class._type,
            )
            loop.run(node.serve(server))

        robot = Robot(node, loop, heard, stopped)
        robot.publish("/button_state", Bool(True))
        robot.publish("/ns/chatter", String("hello"))
        polygon = PolygonStamped()
        polygon.polygon.points = [Point32(1.0, 2.0, 3.0), Point32(4.0, 5.0, 6.0)]
        robot.publish("/poly", polygon)
        yield robot
    finally:
        loop.run(node.close())
        loop.close()


def _set_led_state(body: memoryview, _: object) -> bytes:
    request = SetBoolRequest()
    request.deserialize(bytes(body))
    buffer = BytesIO()
    SetBoolResponse(request.data, "Successfully changed LED state.").serialize(buffer)
    return buffer.getvalue()


def _fail(_: object, __: object) -> bytes:
    raise ServiceException("error processing request: bad thing")


class Result(NamedTuple):
    """A command's exit status and output."""

    status: int
    out: str
    err: str


Command = Callable[..., Result]


def without_ros_words(err: str) -> str:
    """Return minirospy's additions to stderr, without ROS's usage and error messages, which test_wording.py tests."""
    own = re.compile(r"(?!usage: )[a-z][\w.-]*( \w+)?: (?!error: )|WARNING: |did you mean ")
    lines = err.splitlines(keepends=True)
    if not any(re.match(r"[a-z][\w.-]*( \w+)?: ERROR: ", line) for line in lines):
        return err
    return "".join(line for line in lines if own.match(line))


def own_lines(err: str) -> list[str]:
    """Return those lines of an error that are minirospy's own."""
    return without_ros_words(err).splitlines()


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Command:
    """Return a function that runs a command in this process: ``command("rostopic", "list", "-v")``."""

    def run(name: str, *argv: str) -> Result:
        entry = find_script(name) or find_script(name.replace("_", "-")) or find_verb(name)
        assert entry, name
        main = entry.load_main()
        capsys.readouterr()
        try:
            status: Any = main(list(argv))
        except SystemExit as ended:  # argparse exits this way for `-h`
            status = ended.code
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return Result(status, out, without_ros_words(err))

    return run


@pytest.fixture
def program() -> Iterator[Callable[[Sequence[str]], subprocess.Popen[str]]]:
    """Return a function that starts a command's console script as a process, which is terminated after the test."""
    started: list[subprocess.Popen[str]] = []

    def start(words: Sequence[str]) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [str(BIN / words[0]), *words[1:]],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()
