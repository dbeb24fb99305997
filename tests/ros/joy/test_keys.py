"""teleop_twist_keyboard: the effects of keys, and the program in a terminal."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys

import pytest
from geometry_msgs.msg import Twist, TwistStamped

from minirospy import Node
from minirospy.ros.teleop_twist_keyboard.twist_keyboard import HELP, KeyTeleop
from minirospy.workspace.packages import Packages
from tests.ros.robot_state_publisher.conftest import SECONDS, Start

KEYS = {
    "i": (1, 0, 0, 0),
    "o": (1, 0, 0, -1),
    "j": (0, 0, 0, 1),
    "l": (0, 0, 0, -1),
    "u": (1, 0, 0, 1),
    ",": (-1, 0, 0, 0),
    ".": (-1, 0, 0, 1),
    "m": (-1, 0, 0, -1),
    "O": (1, -1, 0, 0),
    "I": (1, 0, 0, 0),
    "J": (0, 1, 0, 0),
    "L": (0, -1, 0, 0),
    "U": (1, 1, 0, 0),
    "<": (-1, 0, 0, 0),
    ">": (-1, -1, 0, 0),
    "M": (-1, 1, 0, 0),
    "t": (0, 0, 1, 0),
    "b": (0, 0, -1, 0),
    "k": (0, 0, 0, 0),
    " ": (0, 0, 0, 0),
    "up": (0, 0, 0, 0),
}


@pytest.mark.parametrize("key", KEYS)
def test_keys_move_as_the_help_says(key: str) -> None:
    teleop = KeyTeleop(0.5, 2.0)
    teleop.press("t")
    assert teleop.press(key) == []
    x, y, z, turn = KEYS[key]
    assert teleop.motion == (x * 0.5, y * 0.5, z * 0.5, turn * 2.0)


def test_no_key_in_time_stops_once() -> None:
    teleop = KeyTeleop(0.5, 1.0)
    assert teleop.press("") is None
    teleop.press("i")
    assert teleop.press("") == []
    assert teleop.motion == (0, 0, 0, 0)
    assert teleop.press("") is None


def test_speeds_change_up_to_their_limits() -> None:
    teleop = KeyTeleop(0.5, 1.0, speed_limit=0.6, turn_limit=2.0)
    assert teleop.speeds == "currently:\tspeed 0.5\tturn 1.0 "
    assert teleop.press("w") == ["currently:\tspeed 0.55\tturn 1.0 "]
    assert teleop.press("w") == ["Linear speed limit reached!", "currently:\tspeed 0.6\tturn 1.0 "]
    assert teleop.press("x") == ["currently:\tspeed 0.54\tturn 1.0 "]
    for _ in range(7):
        teleop.press("e")
    assert teleop.press("e")[:1] == ["Angular speed limit reached!"]  # type: ignore[index]
    teleop.press("i")
    assert teleop.motion == (0.54, 0, 0, 0)


def test_help_is_shown_again_after_fifteen_changes() -> None:
    teleop = KeyTeleop(0.5, 1.0)
    shown = [HELP in (teleop.press("q") or []) for _ in range(30)]
    assert shown == [*[False] * 14, True] * 2


def test_program_without_a_terminal_is_one_line(start: Start) -> None:
    process = start("teleop_twist_keyboard", "teleop_twist_keyboard.py")
    output, errors = process.communicate(timeout=SECONDS)
    assert (process.returncode, output) == (1, "")
    assert errors.count("\n") == 1
    assert "keys come from a terminal, which standard input is not" in errors


class Terminal:
    """The program in a pseudo-terminal."""

    def __init__(self, *words: str) -> None:
        import pty

        self.master, slave = pty.openpty()
        command = Packages().find_executable("teleop_twist_keyboard", "teleop_twist_keyboard.py")
        self.process = subprocess.Popen([*command, *words], stdin=slave, stdout=slave, stderr=subprocess.PIPE)
        os.close(slave)
        self.output = ""

    def read_until(self, text: str) -> None:
        while text not in self.output:
            self.output += os.read(self.master, 4096).decode()

    def close(self) -> str:
        try:
            return (self.process.communicate(timeout=SECONDS)[1] or b"").decode()
        finally:
            self.process.kill()
            os.close(self.master)


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are Unix's")
def test_keys_of_a_terminal_are_published(master: str) -> None:
    terminal = Terminal("_speed:=0.25", "_key_timeout:=30")

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            received = node.subscribe("cmd_vel", Twist)
            found = []
            async for twist in received:
                found.append((twist.linear.x, twist.linear.y, twist.linear.z, twist.angular.z))
                if len(found) == 1:
                    await asyncio.to_thread(terminal.read_until, "currently:\tspeed 0.25\tturn 1.0")
                    os.write(terminal.master, b"U")
                elif len(found) == 2:
                    os.write(terminal.master, b"q")
                elif len(found) == 3:
                    terminal.process.send_signal(signal.SIGINT)
                else:
                    break
            assert found[:2] == [(0, 0, 0, 0), (0.25, 0.25, 0, 0)]
            assert found[2] == pytest.approx((0.275, 0.275, 0, 0))
            assert found[3] == (0, 0, 0, 0)

    try:
        asyncio.run(asyncio.wait_for(body(), SECONDS))
    finally:
        errors = terminal.close()
    assert "Traceback" not in errors
    assert terminal.process.returncode == 0
    assert "Moving around:\r\n   u    i    o\r\n" in terminal.output


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are Unix's")
def test_motion_is_repeated_stamped_and_ends_without_keys(master: str) -> None:
    terminal = Terminal("_repeat_rate:=50", "_stamped:=true", "_frame_id:=base", "_key_timeout:=0.5")

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            motions = []
            async for message in node.subscribe("cmd_vel", TwistStamped):
                if not motions:
                    await asyncio.to_thread(terminal.read_until, "currently:")
                # Try again if the machine was so busy that the key timed out before it was repeated.
                if not motions or (motions[-1] == 0 and motions.count(1.0) <= 2):
                    os.write(terminal.master, b"j")
                assert message.header.frame_id == "base"
                assert message.header.stamp.secs > 0
                motions.append(message.twist.angular.z)
                # The motion is published once for the key, and more often at the rate.
                if motions.count(1.0) > 2 and motions[-1] == 0:
                    break

    try:
        asyncio.run(asyncio.wait_for(body(), SECONDS))
    finally:
        terminal.process.send_signal(signal.SIGINT)
        errors = terminal.close()
    assert "Traceback" not in errors


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are Unix's")
def test_terminal_that_is_closed_ends_the_program(master: str) -> None:
    terminal = Terminal()

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            async for _ in node.subscribe("cmd_vel", Twist):
                await asyncio.to_thread(terminal.read_until, "currently:")
                os.close(terminal.master)
                break

    asyncio.run(asyncio.wait_for(body(), SECONDS))
    _, errors = terminal.process.communicate(timeout=SECONDS)
    assert b"Traceback" not in errors
    assert terminal.process.returncode == 0


def test_wrong_parameters_are_one_line(master: str) -> None:
    if sys.platform == "win32":
        pytest.skip("pseudo-terminals are Unix's")
    terminal = Terminal("_speed:=fast")
    terminal.process.wait(SECONDS)
    errors = terminal.close()
    assert "The speed parameter is [fast]: it is a number" in errors
    assert "Traceback" not in errors
    assert terminal.process.returncode == 1
