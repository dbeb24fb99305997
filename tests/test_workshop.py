"""The workshop's own listings, and the nodes of rpi_feros, as real processes against a real master."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from minirospy.gpio.board import Board

TESTS = Path(__file__).parent
LISTINGS = TESTS / "workshop"
OURS = TESTS.parent / "rpi_feros" / "scripts"
BUTTON = 11
SECONDS_TO_END = 2.0
"""0.2 on a quiet machine; a busy one needs its time."""

Start = Callable[[Path], subprocess.Popen[str]]


@pytest.fixture
def board() -> Iterator[Board]:
    with Board() as board:
        yield board


@pytest.fixture
def start(master: str) -> Iterator[Start]:
    """Starts `python FILE`, as a student does."""
    running: list[subprocess.Popen[str]] = []

    def start(script: Path) -> subprocess.Popen[str]:
        flags = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
        process = subprocess.Popen(
            [sys.executable, str(script)],
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
    server = start(folder / "led_service_server.py")
    client = start(folder / "button_service_client.py")
    # The first press that has an effect shows that both are there.
    deadline = time.monotonic() + 20
    while not board.get(2) and time.monotonic() < deadline:
        board.press(BUTTON)
        board.release(BUTTON)
        time.sleep(0.6)  # longer than the client's bouncetime
    assert board.get(2) == 1
    board.press(BUTTON)
    wait_for(board, 2, 0)
    board.release(BUTTON)
    # The LED is off before the answer is back: a Ctrl-C in between would interrupt the call.
    assert client.stdout is not None
    answers = (line for line in client.stdout if "Successfully changed LED state." in line)
    assert len(list(itertools.islice(answers, 2))) == 2
    interrupt(client)
    interrupt(server)


def test_first_node(start: Start) -> None:
    process = start(LISTINGS / "my_first_node.py")
    output, _ = process.communicate(timeout=20)
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


def wait_for(board: Board, pin: int, level: int, seconds: float = 20.0) -> None:
    edges = board.watch([pin], timeout=seconds)
    if board.get(pin) != level:
        assert any(edge.level == level for edge in edges), f"GPIO {pin} did not go to {level}"
    assert board.get(pin) == level


def interrupt(process: subprocess.Popen[str]) -> str:
    """Ctrl-C: the process ends by itself, soon, with status 0 and without a traceback."""
    began = time.monotonic()
    os.kill(process.pid, signal.SIGINT if os.name == "posix" else signal.CTRL_BREAK_EVENT)  # type: ignore[attr-defined]
    output, _ = process.communicate(timeout=20)
    assert time.monotonic() - began < SECONDS_TO_END
    assert "Traceback" not in output, output
    assert process.returncode == 0, output
    return output
