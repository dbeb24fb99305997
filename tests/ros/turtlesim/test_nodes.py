"""turtlesim_node, draw_square, mimic and turtle_teleop_key as nodes."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from geometry_msgs.msg import Twist
from std_srvs.srv import Empty
from turtlesim.msg import Color, Pose
from turtlesim.srv import Kill, SetPen, Spawn, TeleportAbsolute, TeleportRelative

from minirospy import Node
from minirospy.aio.topics import Publisher
from minirospy.base.errors import ServiceException
from minirospy.workspace.packages import Packages
from tests.ros.robot_state_publisher.conftest import SECONDS, Start, end


def run(body: Callable[[Node], Awaitable[None]]) -> None:
    async def main() -> None:
        async with Node("test", rosout=False) as node:
            await asyncio.wait_for(body(node), SECONDS)

    asyncio.run(main())


async def until(node: Node, topic: str, kind: type, is_right: Callable[[object], bool]) -> object:
    """Return the first message on a topic that meets a condition."""
    async for message in node.subscribe(topic, kind):
        if is_right(message):
            return message
    raise AssertionError


async def driven(
    node: Node, commands: Publisher[Twist], twist: Twist, topic: str, is_right: Callable[[object], bool]
) -> object:
    """Publish a command until a pose meets a condition."""
    return await commanded(node, lambda: commands.publish(twist), topic, is_right)


async def commanded(
    node: Node, command: Callable[[], Awaitable[None]], topic: str, is_right: Callable[[object], bool]
) -> object:
    """Repeat a command until a pose meets a condition: a command is in effect for a second, and poses may arrive later."""
    following = asyncio.ensure_future(until(node, topic, Pose, is_right))
    while not following.done():
        await command()
        await asyncio.wait({following}, timeout=0.2)
    return following.result()


def test_turtle_is_driven_and_drawn(start: Start) -> None:
    process = start("turtlesim", "turtlesim_node", "_background_r:=300")

    async def body(node: Node) -> None:
        pose = await until(node, "turtle1/pose", Pose, lambda pose: True)
        assert (pose.x, pose.y, pose.theta) == (pytest.approx(5.544445), pytest.approx(5.544445), 0.0)
        assert await until(node, "turtle1/color_sensor", Color, lambda color: True) == Color(44, 86, 255)
        assert await node.get_param("/turtlesim/background_g") == 86

        await node.wait_for_service("turtle1/teleport_absolute")
        await node.call("turtle1/set_pen", SetPen, r=255, g=1, b=2, width=9)
        commands = node.advertise("turtle1/cmd_vel", Twist)
        await commands.wait_for_subscribers()
        twist = Twist()
        twist.linear.x = 2.0
        moving = await driven(node, commands, twist, "turtle1/pose", lambda pose: pose.linear_velocity)
        assert moving.linear_velocity == 2.0
        await until(node, "turtle1/color_sensor", Color, lambda color: color == Color(255, 1, 2))
        await until(node, "turtle1/pose", Pose, lambda pose: not pose.linear_velocity)

        await node.call("turtle1/teleport_absolute", TeleportAbsolute, x=2, y=3, theta=math.pi / 2)
        await node.call("turtle1/teleport_relative", TeleportRelative, linear=20)
        await until(node, "turtle1/pose", Pose, lambda pose: pose.y == pytest.approx(11.088889))
        await node.call("clear", Empty)
        await until(node, "turtle1/color_sensor", Color, lambda color: color == Color(44, 86, 255))
        await node.call("reset", Empty)
        await until(node, "turtle1/pose", Pose, lambda pose: pose.x == pytest.approx(5.544445))

    run(body)
    output, errors = end(process)
    assert "Starting turtlesim with node name /turtlesim" in output
    spawned = "Spawning turtle [turtle1] at x=[5.544445], y=[5.544445], theta=[0.000000]"
    assert output.count(spawned) == 2
    assert output.index("Clearing turtlesim.") < output.index("Resetting turtlesim.")
    assert "Oh no! I hit the wall! (Clamping from [x=1.999999, y=-11.911111])" in errors
    assert process.returncode == 0


CALLED_AT_ONCE = """
import threading
import rospy
from minirospy.ros.turtlesim import node
from turtlesim.srv import SpawnRequest

service = rospy.Service

def called_at_once(name, kind, handler):
    made = service(name, kind, handler)
    if name == "spawn":
        caller = threading.Thread(target=lambda: print(handler(SpawnRequest(2, 2, 0, "")).name, flush=True))
        caller.start()
        caller.join(0.5)
    return made

node.rospy.Service = called_at_once
rospy.init_node("turtlesim")
node.Simulator().start()
"""


def test_turtle_spawned_while_the_node_starts_is_the_second(master: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", CALLED_AT_ONCE], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.splitlines()[-1] == "turtle2", done


def test_turtles_come_and_go(start: Start) -> None:
    process = start("turtlesim", "turtlesim_node")

    async def body(node: Node) -> None:
        await node.wait_for_service("turtle1/teleport_absolute")
        assert (await node.call("spawn", Spawn, x=2, y=2, theta=0.5)).name == "turtle2"
        assert (await node.call("spawn", Spawn, x=1, y=1, name="Fred")).name == "Fred"
        await until(node, "Fred/pose", Pose, lambda pose: pose.x == 1.0)
        for name in ("Fred", "/Fred", "no name", "x-y"):
            with pytest.raises(ServiceException):
                await node.call("spawn", Spawn, name=name)
        with pytest.raises(ServiceException):
            await node.call("spawn", Spawn, x=math.nan)
        await node.call("kill", Kill, name="Fred")
        with pytest.raises(ServiceException):
            await node.call("kill", Kill, name="Fred")
        # Another turtle can use the topics and services of a removed one.
        assert (await node.call("spawn", Spawn, x=3, y=1, name="Fred")).name == "Fred"
        await until(node, "Fred/pose", Pose, lambda pose: pose.x == 3.0)

        poses = node.subscribe("turtle1/pose", Pose)
        await poses.wait_for_publishers()
        await node.call("reset", Empty)
        assert {name for name in await topics(node) if name.endswith("/pose")} == {"/turtle1/pose"}
        async for _ in poses:
            break

    async def topics(node: Node) -> set[str]:
        from minirospy.base.environment import Environment
        from minirospy.runtime.rpc.master_proxy import MasterProxy

        proxy = MasterProxy(Environment.read().master_uri, "/test")
        try:
            state = await asyncio.to_thread(proxy.get_system_state)
            return set(state.publishers)
        finally:
            proxy.close()

    run(body)
    _, errors = end(process)
    assert "A turtled named [Fred] already exists" in errors
    assert "Tried to kill turtle [Fred], which does not exist" in errors


def test_velocity_that_is_not_finite_is_one_line(start: Start) -> None:
    process = start("turtlesim", "turtlesim_node")

    async def body(node: Node) -> None:
        commands = node.advertise("turtle1/cmd_vel", Twist, latch=True)
        twist = Twist()
        twist.linear.x = math.nan
        await commands.publish(twist)
        await commands.wait_for_subscribers()
        twist.linear.x = 1.0
        await driven(node, commands, twist, "turtle1/pose", lambda pose: pose.linear_velocity == 1.0)

    run(body)
    end(process)


def test_square_is_drawn_by_draw_square(start: Start) -> None:
    start("turtlesim", "turtlesim_node")

    async def body(node: Node) -> None:
        await node.wait_for_service("reset")
        turns = False
        # As in the tutorial, the turtle drives on if it has seen no pose within 0.1 m of its goal; then try again.
        while not turns:
            process = start("turtlesim", "draw_square")
            await until(node, "turtle1/pose", Pose, lambda pose: pose.x < 5.6)
            pose = await until(
                node,
                "turtle1/pose",
                Pose,
                lambda pose: pose.angular_velocity == pytest.approx(0.4) or pose.x > 8.0,
            )
            turns = pose.x < 8.0
            output, _ = await asyncio.to_thread(end, process)
        assert "New goal [7.544445 5.544445, 0.000000]" in output
        assert "Reached goal" in output
        assert ", 1.570796]" in output

    run(body)


def test_mimic_copies_by_remapped_namespaces(start: Start) -> None:
    start("turtlesim", "turtlesim_node")
    start("turtlesim", "mimic", "input:=turtle1", "output:=turtle2")

    async def body(node: Node) -> None:
        await node.wait_for_service("turtle1/teleport_absolute")
        await node.call("spawn", Spawn, x=1, y=1)
        commands = node.advertise("turtle1/cmd_vel", Twist)
        await commands.wait_for_subscribers()
        twist = Twist()
        twist.linear.x, twist.angular.z = 1.5, -0.5
        # Repeat until mimic is connected to both turtles.
        copied = await driven(node, commands, twist, "turtle2/pose", lambda pose: pose.linear_velocity == 1.5)
        assert copied.angular_velocity == -0.5  # type: ignore[attr-defined]

    run(body)


def test_teleop_without_a_terminal_is_one_line(start: Start) -> None:
    process = start("turtlesim", "turtle_teleop_key")
    output, errors = process.communicate(timeout=SECONDS)
    assert process.returncode == 1
    assert output == ""
    assert errors.startswith("turtle_teleop_key: ERROR: keys come from a terminal")
    assert errors.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are Unix's")
def test_arrow_keys_drive_a_turtle_that_is_drawn(master: str, tmp_path: Path) -> None:
    """Both programs run in terminals, as in the tutorial; parameters scale the motions of keys."""
    turtles, teleop = Terminal("turtlesim_node"), Terminal("turtle_teleop_key")
    try:
        turtles.wait_for("Spawning turtle [turtle1]")
        turtles.wait_for("TurtleSim")
        turtles.wait_for("turtle1: x=5.54 y=5.54 theta=0.00")
        teleop.wait_for("Use arrow keys to move the turtle. 'q' to quit.")

        async def body(node: Node) -> None:
            keys = node.subscribe("turtle1/cmd_vel", Twist)
            await keys.wait_for_publishers()
            for key, linear, angular in (("A", 2, 0), ("B", -2, 0), ("D", 0, 2), ("C", 0, -2)):
                teleop.type("x\x1b[" + key)
                async for twist in keys:
                    assert (twist.linear.x, twist.angular.z) == (linear, angular)
                    break

            async def turn() -> None:
                teleop.type("\x1b[C")

            await commanded(
                node, turn, "turtle1/pose", lambda pose: pose.angular_velocity == -2 and pose.theta < 0
            )

        run(body)
        teleop.type("q")
        assert teleop.status() == 0
        turtles.wait_for("theta=-")
        turtles.interrupt()
        assert turtles.status() == 0
    finally:
        teleop.close()
        turtles.close()


class Terminal:
    """A program of turtlesim in a terminal, and all of its output."""

    def __init__(self, program: str) -> None:
        import fcntl
        import pty
        import termios

        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 100, 0, 0))
        self._process = subprocess.Popen(
            Packages().find_executable("turtlesim", program),
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env=os.environ | {"TERM": "xterm-256color"},
        )
        os.close(slave)
        self._shown = ""
        self._changed = threading.Condition()
        self._reading = threading.Thread(target=self._read, daemon=True)
        self._reading.start()

    def type(self, keys: str) -> None:
        os.write(self._master, keys.encode())

    def wait_for(self, text: str) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: text in self._shown, SECONDS), self._shown

    def interrupt(self) -> None:
        self._process.send_signal(signal.SIGINT)

    def status(self) -> int:
        status = self._process.wait(SECONDS)
        self._reading.join(SECONDS)
        assert "Traceback" not in self._shown, self._shown
        return status

    def _read(self) -> None:
        # Read continuously: a program whose terminal is full blocks, and its turtle stands still. On Linux, reading
        # from a closed terminal raises an error.
        with contextlib.suppress(OSError):
            while data := os.read(self._master, 65536):
                with self._changed:
                    self._shown += data.decode(errors="replace")
                    self._changed.notify_all()

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        self._reading.join(SECONDS)
        os.close(self._master)
