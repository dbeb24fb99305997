"""The workshop's own listings, and the nodes of rpi_feros, as real processes against a real master."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from minirospy.board.board import Board
from minirospy.board.model import Function

TESTS = Path(__file__).parent
LISTINGS = TESTS / "workshop"
OURS = TESTS.parent / "rpi_feros" / "scripts"
BUTTON = 11
CTRL_C = signal.SIGINT if os.name == "posix" else signal.CTRL_BREAK_EVENT  # type: ignore[attr-defined]

LEDS = range(2, 8)
CANCEL = """
import rospy
from actionlib_msgs.msg import GoalID
rospy.init_node("cancel", argv=[])
cancel = rospy.Publisher("run_led/cancel", GoalID, queue_size=1)
cancel.wait_for_subscribers(timeout=30)
print("ready", flush=True)
input()
cancel.publish(GoalID())
"""

SPINNING = """
import runpy, sys
import rospy

spin = rospy.spin
rospy.spin = lambda: (print("spins", flush=True), spin())
runpy.run_path(sys.argv.pop(1), run_name="__main__")
"""
"""Runs a program, and prints a line when everything before its rospy.spin() is done."""

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def board() -> Iterator[Board]:
    with Board() as board:
        yield board


@pytest.fixture
def start(master: str) -> Iterator[Start]:
    """Return a function that starts `python ARGUMENTS`, as a student does."""
    running: list[subprocess.Popen[str]] = []

    def start(*arguments: str | Path) -> subprocess.Popen[str]:
        flags = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
        process = subprocess.Popen(
            [sys.executable, *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            creationflags=flags,
        )
        running.append(process)
        return process

    yield start
    for process in running:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("folder", [LISTINGS, OURS], ids=["listing", "rpi_feros"])
def test_led_follows_the_button_by_topic(folder: Path, start: Start, board: Board) -> None:
    publisher = start(folder / "button_publisher.py")
    actuator = start(folder / "led_actuator.py")
    for _ in range(2):
        board.press(BUTTON)
        wait_for(board, 7, 1)
        board.release(BUTTON)
        wait_for(board, 7, 0)
    interrupt(publisher)
    interrupt(actuator)


@pytest.mark.parametrize("folder", [LISTINGS, OURS], ids=["listing", "rpi_feros"])
def test_each_press_toggles_the_led_by_service(folder: Path, start: Start, board: Board) -> None:
    server = start("-c", SPINNING, folder / "led_service_server.py")
    wait_line(server, "spins")
    client = start("-c", SPINNING, folder / "button_service_client.py")
    wait_line(client, "spins")
    edges = board.watch([2], timeout=60)
    for level in (1, 0, 1):
        board.press(BUTTON)
        board.release(BUTTON)
        assert next(edges).level == level
        # The LED changes before the response arrives, and a Ctrl-C in between would interrupt the call.
        wait_line(client, "Successfully changed LED state.")
        # Wait for the client's bouncetime, in which it ignores the button.
        time.sleep(0.6)
    interrupt(client)
    interrupt(server)


def test_first_node(start: Start) -> None:
    process = start(LISTINGS / "my_first_node.py")
    output, _ = process.communicate(timeout=30)
    assert process.returncode == 0
    assert "This node has been started." in output
    assert output.splitlines()[-1] == "Exit now"


def test_first_node_as_a_class_ends_by_ctrl_c(start: Start) -> None:
    process = start(LISTINGS / "my_first_node_class.py")
    assert process.stdout is not None
    first = process.stdout.readline()
    assert "This node has been started." in first
    output = interrupt(process)
    assert "This node has been terminated." in output
    assert "Exit now" not in output


def test_action_client_prints_the_progress_of_the_leds(start: Start, board: Board) -> None:
    server = start(LISTINGS / "ledrun_server.py")
    wait_line(server, "Server pripravljen")
    # Start it before the runs, which take a second each; otherwise all ten may be over when it is ready.
    cancel = start("-c", CANCEL)
    wait_line(cancel, "ready")
    edges = board.watch(LEDS, timeout=40)
    client = start(LISTINGS / "ledrun_client.py")
    wait_line(client, "Server is active.")
    lit = [edge.pin for edge, _ in zip((edge for edge in edges if edge.level), range(7), strict=False)]
    assert lit == [*LEDS, 2]
    cancel.communicate("\n", timeout=30)
    output, _ = client.communicate(timeout=30)
    # The goal is cancelled in the second run, or in a later one on a busy machine.
    assert re.fullmatch(r"Result: [2-9]\n", output)
    said = interrupt(server)
    assert "Stevilo iteracij: 10" in said
    assert "Goal preempted." in said


def test_ctrl_c_ends_the_server_in_the_middle_of_a_goal(start: Start, board: Board) -> None:
    server = start(LISTINGS / "ledrun_server.py")
    wait_line(server, "Server pripravljen")
    edges = board.watch([3], timeout=40)
    client = start(LISTINGS / "ledrun_client.py")
    assert any(edge.level for edge in edges)
    interrupt(server)
    # The client waits for a server to return; without one, Ctrl-C stops the client. The listing then has no result to print.
    wait_line(client, "Server is active.")
    client.send_signal(CTRL_C)
    output, _ = client.communicate(timeout=30)
    assert "'NoneType' object has no attribute 'finalRun'" in output


def test_node_of_the_tour_runs(start: Start, board: Board, tmp_path: Path) -> None:
    text = (TESTS.parent / "docs" / "tour.md").read_text(encoding="utf-8")
    node = tmp_path / "my_node.py"
    node.write_text(re.findall(r"```python\n(import rospy.*?)```", text, re.DOTALL)[0])
    publisher, mine = start(OURS / "button_publisher.py"), start(node)
    board.press(BUTTON)
    wait_for(board, 4, 1)
    interrupt(publisher)
    interrupt(mine)
    # The next program will then print no warnings about pins in use.
    assert board.state().pins[4].function is Function.IN


def wait_line(process: subprocess.Popen[str], text: str) -> None:
    assert process.stdout
    said = []
    for line in process.stdout:
        said.append(line)
        if text in line:
            return
    raise AssertionError(f"not {text!r}, but {said}")


def wait_for(board: Board, pin: int, level: int, seconds: float = 40.0) -> None:
    edges = board.watch([pin], timeout=seconds)
    if board.get(pin) != level:
        assert any(edge.level == level for edge in edges), f"GPIO {pin} did not go to {level}"
    assert board.get(pin) == level


def interrupt(process: subprocess.Popen[str]) -> str:
    """Send Ctrl-C; assert that the process exits soon with status 0 and without a traceback; return its output."""
    process.send_signal(CTRL_C)
    # This takes 0.2 s on a quiet machine; a program that is not notified of the shutdown runs forever.
    output, _ = process.communicate(timeout=100)
    assert "Traceback" not in output, output
    assert process.returncode == 0, output
    return output
