"""A fleet with real ROS 1 masters, nodes and commands on both sides, and a slow link between network namespaces, which is cut."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import free_port
from tests.interop.conftest import OUR_BIN, PATIENCE, REAL_BIN, REAL_PYTHON, running_master, start, stop

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

PORT = 7447


@pytest.fixture
def running() -> Iterator[ExitStack]:
    """Return a stack that stops everything that was started."""
    with ExitStack() as stack:
        yield stack


def test_real_nodes_and_commands_on_both_sides(running: ExitStack) -> None:
    robot, control = (running.enter_context(running_master("rospy")) for _ in range(2))
    endpoint = f"127.0.0.1:{free_port()}"

    def run(words: list[str], uri: str, stack: str, **streams: Any) -> subprocess.Popen[str]:
        program = start(words, uri, stack, **streams)
        running.callback(stop, program)
        return program

    fleet = str(OUR_BIN / "minirospy")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    run([fleet, "fleet", "control", "--listen", endpoint], control, "ours", **quiet)
    services = ["--services", "/talker/*"]
    run(
        [fleet, "fleet", "gateway", "--name", "robot1", "--connect", endpoint, *services],
        robot,
        "ours",
        **quiet,
    )
    rostopic, rosservice = str(REAL_BIN / "rostopic"), str(REAL_BIN / "rosservice")
    talker = [rostopic, "pub", "-r", "10", "/chatter", "std_msgs/String", "hello", "__name:=talker"]
    run(talker, robot, "rospy", **quiet)

    echo = run([rostopic, "echo", "-n", "1", "/robot1/chatter/data"], control, "rospy")
    assert echo.communicate(timeout=PATIENCE)[0].startswith('"hello"')
    listed = run([rostopic, "list", "-v"], control, "rospy").communicate(timeout=PATIENCE)[0]
    assert " * /robot1/chatter [std_msgs/String] 1 publisher" in listed

    def call() -> str:
        words = [rosservice, "call", "/robot1/talker/get_loggers"]
        return run(words, control, "rospy").communicate(timeout=PATIENCE)[0]

    end = time.monotonic() + PATIENCE
    while "rosout" not in (answer := call()):
        assert time.monotonic() < end, answer

    # Test the reverse direction: a command in the control room for one of the robot's nodes.
    listener = (
        "import rospy; from std_msgs.msg import Int32; rospy.init_node('listener'); "
        "print(rospy.wait_for_message('/order', Int32))"
    )
    heard = run([REAL_PYTHON, "-c", listener], robot, "rospy")
    order = [rostopic, "pub", "-r", "5", "/robot1/order", "std_msgs/Int32", "7"]
    run(order, control, "rospy", **quiet)
    assert heard.communicate(timeout=PATIENCE)[0].startswith("data: 7")


# --- a link between namespaces


class Link:
    """Two network namespaces, a control room and a robot, and the link between them."""

    def __init__(self) -> None:
        self.names = [f"minirospy-{side}-{os.getpid()}" for side in ("room", "robot")]
        self.running = ExitStack()

    def build(self) -> None:
        """Create the namespaces and the link. Raise OSError or CalledProcessError if this is not permitted."""
        for name in self.names:
            self.sh(f"ip netns add {name}")
        self.sh(f"ip link add veth0 netns {self.names[0]} type veth peer name veth0 netns {self.names[1]}")
        for number, name in enumerate(self.names, 1):
            self.sh(f"ip -n {name} link set lo up")
            self.sh(f"ip -n {name} link set veth0 up")
            self.sh(f"ip -n {name} addr add 10.98.0.{number}/24 dev veth0")

    def remove(self) -> None:
        self.running.close()
        for name in self.names:
            subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)

    def start(self, side: int, role: str) -> Peer:
        words = ["ip", "netns", "exec", self.names[side], sys.executable]
        peer = Peer([*words, str(Path(__file__).with_name("fleet_peer.py")), role, f"tcp/10.98.0.1:{PORT}"])
        self.running.callback(peer.end)
        return peer

    @staticmethod
    def sh(command: str) -> None:
        subprocess.run(command.split(), check=True, capture_output=True)


class Peer:
    """A program that prints its observations."""

    def __init__(self, words: list[str]) -> None:
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def until(self, condition: Callable[[Any], Any]) -> Any:
        """Return the first observation that meets a condition."""
        assert self._process.stdout
        end = time.monotonic() + PATIENCE
        while True:
            line = self._process.stdout.readline()
            assert line, "the program has ended"
            if condition(seen := json.loads(line)):
                return seen
            assert time.monotonic() < end, line

    def end(self) -> None:
        self._process.communicate(timeout=PATIENCE)


@pytest.fixture
def link() -> Iterator[Link]:
    """Return two namespaces and the link between them."""
    made = Link()
    try:
        made.build()
    except (OSError, subprocess.CalledProcessError):
        made.remove()
        pytest.skip("network namespaces need root, and `ip`")
    yield made
    made.remove()


def sent(seen: Any, topic: str) -> Any:
    """Return the number of messages that a robot has sent on a topic."""
    return next(
        (each for each in seen["status"]["sent"] if each["topic"] == topic), {"messages": 0, "dropped": 0}
    )


def test_commands_pass_a_slow_link_before_images(link: Link) -> None:
    for name in link.names:
        link.sh(
            f"ip netns exec {name} tc qdisc replace dev veth0 root tbf rate 8mbit burst 32kb latency 50ms"
        )
    room = link.start(0, "room")
    room.until(lambda _: True)
    robot = link.start(1, "robot")
    seen = robot.until(
        lambda seen: sent(seen, "/image")["dropped"] > 20 and sent(seen, "/velocity")["messages"] > 30
    )
    assert sent(seen, "/image")["messages"] > 0
    assert sent(seen, "/velocity")["dropped"] == 0
    room.until(lambda seen: seen["counts"].get("/robot1/velocity", 0) > 30)


def test_a_cable_that_is_pulled_and_plugged_in_again(link: Link) -> None:
    room = link.start(0, "room")
    room.until(lambda _: True)
    link.start(1, "robot")
    before = room.until(lambda seen: seen["counts"].get("/robot1/velocity", 0))["counts"]["/robot1/velocity"]
    link.sh(f"ip -n {link.names[1]} link set veth0 down")
    room.until(lambda seen: not seen["status"]["robots"])
    link.sh(f"ip -n {link.names[1]} link set veth0 up")
    room.until(lambda seen: seen["status"]["robots"] and seen["counts"]["/robot1/velocity"] > before + 5)
