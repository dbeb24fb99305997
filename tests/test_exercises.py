"""The workshop's exercises, solved in rpi_feros, on the virtual board and before the simulated scanner."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from minirospy.gpio.board import Board

ROOT = Path(__file__).parents[1]
SCRIPTS = ROOT / "rpi_feros" / "scripts"
SCANNER = ROOT / "msgs" / "sick_safetyscanners" / "scripts" / "sick_safetyscanners_node"
BIN = Path(sys.executable).parent
GREEN, YELLOW, RED = (2, 3), (4, 5), (6, 7)

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def board() -> Iterator[Board]:
    with Board() as board:
        yield board


@pytest.fixture
def start(master: str) -> Iterator[Start]:
    """Starts a program, its output in a pipe."""
    running: list[subprocess.Popen[str]] = []

    def start(*command: object) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        running.append(process)
        return process

    yield start
    for process in running:
        process.kill()
        process.communicate()


@pytest.fixture
def person(start: Start, board: Board) -> Callable[[float], None]:
    """Puts a person before a running scanner, so many metres from it (the nearest leg is 0.15 m nearer)."""
    start(sys.executable, SCANNER, "__ns:=/sick_safetyscanners")

    def move(away: float) -> None:
        board.move_person((away, 0.0))

    return move


def node(start: Start, name: str) -> subprocess.Popen[str]:
    return start(sys.executable, SCRIPTS / name)


def wait_for_lit(board: Board, *pins: int, seconds: float = 20.0) -> None:
    """Until these LEDs are lit, and no other."""
    expected = {pin: int(pin in pins) for pin in range(2, 8)}
    edges = board.watch(list(expected), timeout=seconds)

    def lit() -> dict[int, int]:
        return {pin: board.get(pin) for pin in expected}

    if lit() != expected:
        assert any(lit() == expected for _ in edges), f"lit are {lit()}"


def test_led_on_when_something_is_near(start: Start, board: Board, person: Callable[[float], None]) -> None:
    node(start, "led_actuator.py")
    node(start, "sick_dist_switch.py")
    person(0.3)
    wait_for_lit(board, 7)
    person(0.5)
    wait_for_lit(board)


def test_zones(start: Start, board: Board, person: Callable[[float], None]) -> None:
    node(start, "led_zone.py")
    node(start, "sick_zone.py")
    wait_for_lit(board, *GREEN)
    person(0.45)
    wait_for_lit(board, *YELLOW)
    person(0.3)
    wait_for_lit(board, *RED)
    person(1000)
    wait_for_lit(board, *GREEN)


def test_buttons_move_the_led(start: Start, board: Board) -> None:
    node(start, "move_led_server.py")
    wait_for_lit(board, 2)
    client = node(start, "move_led_client.py")
    # The client watches its buttons once it is in the graph and has found the service.
    graph: list[str | Path] = [BIN / "rosnode", "list"]
    while "/button_monitor" not in subprocess.run(graph, capture_output=True, text=True, check=True).stdout:
        assert client.poll() is None
    lit = 2
    for button, led in ((11, 7), (12, 2), (12, 3)):
        while lit != led:
            board.press(button)
            edges = board.watch([led], timeout=1.0)
            if board.get(led) or any(edge.level for edge in edges):
                lit = led
            board.release(button)
    wait_for_lit(board, 3)


def test_run_debug_lights_each_led(start: Start, board: Board) -> None:
    edges = board.watch(list(range(2, 8)), timeout=20.0)
    node(start, "run_debug.py")
    lit = []
    for edge in edges:
        if edge.level:
            lit.append(edge.pin)
        if len(lit) == 6:
            break
    assert lit == [2, 3, 4, 5, 6, 7]
    board.press(12)
    wait_for_lit(board, 3)


def test_the_launch_file_of_each(start: Start, master: str) -> None:
    """They load, and every node in them has a program."""
    for file in sorted((ROOT / "launch").glob("*.launch")):
        done = subprocess.run(
            [BIN / "roslaunch", "rpi_feros_bringup", file.name, "--nodes"],
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.count("\n") >= 2
