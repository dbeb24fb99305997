"""The workshop's action listings, as processes against a real master and the virtual board."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from minirospy.gpio.board import Board

LISTINGS = Path(__file__).parents[1] / "workshop"
LEDS = range(2, 8)
CANCEL = """
import rospy
from actionlib_msgs.msg import GoalID
rospy.init_node("cancel", argv=[])
cancel = rospy.Publisher("run_led/cancel", GoalID, queue_size=1)
cancel.wait_for_subscribers(timeout=20)
cancel.publish(GoalID())
"""

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def board() -> Iterator[Board]:
    with Board() as board:
        yield board


@pytest.fixture
def start(master: str) -> Iterator[Start]:
    """Starts `python ARGUMENTS`, as a student does."""
    running: list[subprocess.Popen[str]] = []

    def start(*arguments: str) -> subprocess.Popen[str]:
        flags = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
        process = subprocess.Popen(
            [sys.executable, *arguments],
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


def wait_line(process: subprocess.Popen[str], text: str) -> None:
    assert process.stdout
    said = []
    for line in process.stdout:
        said.append(line)
        if text in line:
            return
    raise AssertionError(f"not {text!r}, but {said}")


def interrupt(process: subprocess.Popen[str]) -> str:
    """Ctrl-C: it ends by itself, with status 0 and without a traceback."""
    os.kill(process.pid, signal.SIGINT if os.name == "posix" else signal.CTRL_BREAK_EVENT)  # type: ignore[attr-defined]
    output, _ = process.communicate(timeout=20)
    assert "Traceback" not in output, output
    assert process.returncode == 0, output
    return output


def test_the_leds_run_and_the_client_tells_how_far_they_came(start: Start, board: Board) -> None:
    server = start(str(LISTINGS / "ledrun_server.py"))
    wait_line(server, "Server pripravljen")
    edges = board.watch(list(LEDS), timeout=20)
    client = start(str(LISTINGS / "ledrun_client.py"))
    wait_line(client, "Server is active.")
    lit = [edge.pin for edge, _ in zip((edge for edge in edges if edge.level), range(7), strict=False)]
    assert lit == [*LEDS, 2]
    start("-c", CANCEL).communicate(timeout=20)
    output, _ = client.communicate(timeout=20)
    # The second run, or a later one where starting CANCEL took its time.
    assert re.fullmatch(r"Result: [2-9]\n", output)
    said = interrupt(server)
    assert "Stevilo iteracij: 10" in said
    assert "Goal preempted." in said


def test_ctrl_c_ends_the_server_in_the_middle_of_a_goal(start: Start, board: Board) -> None:
    server = start(str(LISTINGS / "ledrun_server.py"))
    wait_line(server, "Server pripravljen")
    edges = board.watch([3], timeout=20)
    client = start(str(LISTINGS / "ledrun_client.py"))
    assert any(edge.level for edge in edges)
    interrupt(server)
    # It waits for a server that comes back; without one, Ctrl-C ends it. The listing then has no result to tell.
    wait_line(client, "Server is active.")
    os.kill(client.pid, signal.SIGINT if os.name == "posix" else signal.CTRL_BREAK_EVENT)  # type: ignore[attr-defined]
    output, _ = client.communicate(timeout=20)
    assert "'NoneType' object has no attribute 'finalRun'" in output
