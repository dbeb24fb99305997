"""One board used by several processes is shared, persistent, started once, and replaced when it dies."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from minirospy.base.errors import BoardError
from minirospy.board import link
from minirospy.board.board import Board
from minirospy.board.directory import BoardDirectory
from minirospy.board.model import Function
from minirospy.board.rpigpio import BCM, OUT, Gpio
from tests.waiting import wait_until


@pytest.fixture
def board() -> Iterator[Board]:
    with Board() as board:
        yield board


def servers(directory: BoardDirectory) -> list[psutil.Process]:
    return [
        process
        for process in psutil.process_iter(["cmdline"])
        if (process.info["cmdline"] or [])[-2:] == [str(directory.folder), directory.name]
    ]


def wait_until_gone(directory: BoardDirectory) -> None:
    _, left = psutil.wait_procs(servers(directory), timeout=30)
    assert not left


def test_levels_and_snapshot(board: Board) -> None:
    before = board.state()
    board.press(11)
    assert board.get(11) == 1
    assert board.levels()[11] == 1
    assert len(board.levels()) == 54
    assert (before.level(11), board.state().level(11)) == (0, 1)
    assert board.state().pins[11].function is Function.IN


def test_refusals(board: Board) -> None:
    with pytest.raises(BoardError, match=r"^pin 99 does not exist: BCM numbers are 0 to 53$"):
        board.press(99)
    with pytest.raises(BoardError, match=r"^pin -1 does not exist"):
        board.get(-1)
    with pytest.raises(BoardError, match=r"^a level is 0 or 1, not 2$"):
        board.set(17, 2)
    board.press(11)
    assert board.get(11) == 1


def test_a_bad_name() -> None:
    with pytest.raises(BoardError, match="the board's name"):
        Board("../elsewhere")


def test_closed(board: Board) -> None:
    board.close()
    board.close()
    with pytest.raises(BoardError, match="is closed"):
        board.press(11)


def test_watch_prints_the_chosen_pins_until_the_timeout(board: Board) -> None:
    edges = board.watch([12], timeout=30)
    board.press(11)
    board.press(12)
    board.release(12)
    assert [(edge.pin, edge.level) for edge in itertools.islice(edges, 2)] == [(12, 1), (12, 0)]
    assert not list(board.watch([12], timeout=0.05))


# Start listening before printing: an edge before wait_for_edge() starts would be lost, as on hardware.
CHILD = """
import threading
from RPi import GPIO
GPIO.setmode(GPIO.BCM)
GPIO.setup(11, GPIO.IN)
GPIO.setup(7, GPIO.OUT)
pressed = threading.Event()
GPIO.add_event_detect(11, GPIO.RISING, callback=lambda channel: pressed.set())
print("ready", flush=True)
pressed.wait(30)
GPIO.output(7, GPIO.input(11))
"""


def test_two_processes_share_a_board_and_the_pins_outlive_them(board: Board) -> None:
    with subprocess.Popen([sys.executable, "-c", CHILD], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        child.stdout.readline()
        edges = board.watch([7], timeout=40)
        board.press(11)
        assert next(edges).level == 1
        assert child.wait(30) == 0
    assert board.get(7) == 1
    assert board.state().pins[7].function is Function.OUT


def test_many_start_one_server() -> None:
    code = "from minirospy.board.board import Board\nwith Board() as b:\n print(b.name, flush=True)\n input()"
    children = [
        subprocess.Popen(
            [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        for _ in range(4)
    ]
    opened: list[Board] = []
    threads = [threading.Thread(target=lambda: opened.append(Board())) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)

    for child in children:
        assert child.stdout is not None
        assert child.stdout.readline().startswith("test-")

    assert len(opened) == 4
    opened[0].press(11)
    edges = opened[1].watch([12], timeout=40)
    opened[2].press(12)
    assert next(edges).level == 1
    # Servers that were too late may still be exiting; only one remains.
    wait_until(lambda: len(servers(BoardDirectory.find())) == 1)

    for child in children:
        child.communicate("\n", timeout=30)
        assert child.returncode == 0

    for board in opened:
        board.close()


def test_a_killed_server_is_replaced_unnoticed(board: Board) -> None:
    gpio = Gpio()
    gpio.setmode(BCM)
    gpio.setup(7, OUT, initial=1)
    edges = board.watch([12], timeout=40)
    for server in servers(BoardDirectory.find()):
        server.kill()
    gpio.output(7, 0)
    gpio.output(7, 1)
    board.press(12)
    assert next(edges).level == 1
    gpio._linked().call(None)
    board._link.call(None)
    assert (gpio.input(7), board.get(7)) == (1, 1)
    assert board.state().pins[7].function is Function.OUT
    gpio.close()


def test_an_unused_server_ends_and_the_next_one_goes_on() -> None:
    directory = BoardDirectory.find()
    with Board() as board:
        board.press(11)
    wait_until_gone(directory)
    assert not directory.socket_path.exists()
    with Board() as board:
        assert board.get(11) == 1
        board.release(11)
    wait_until_gone(directory)


def test_spoilt_pins_are_a_fresh_board() -> None:
    directory = BoardDirectory.find()
    directory.prepare()
    directory.state_path.write_bytes(b"\xc1 not pins")
    with Board() as board:
        assert set(board.levels().values()) == {0}


def test_tcp_is_used_if_the_path_is_too_long_for_a_socket(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINIROSPY_RUNTIME_DIR", str(tmp_path / ("d" * 120)))
    directory = BoardDirectory.find()
    assert not directory.uses_unix_socket
    with Board() as board, Board() as other:
        edges = other.watch([11], timeout=40)
        board.press(11)
        assert next(edges).level == 1
        if sys.platform != "win32":
            assert directory.address_path.stat().st_mode & 0o077 == 0
    wait_until_gone(directory)
    assert not directory.address_path.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
def test_a_folder_open_to_others_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o777)
    monkeypatch.setenv("MINIROSPY_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(BoardError, match="is open to others"):
        Board()


@pytest.mark.skipif(os.name != "posix", reason="no signals")
def test_a_server_that_a_ctrl_c_killed_is_started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    start = link._start_server
    started: list[subprocess.Popen[bytes]] = []

    def first_one_is_killed(directory: BoardDirectory) -> subprocess.Popen[bytes]:
        started.append(subprocess.Popen(["sh", "-c", "kill -INT $$"]) if not started else start(directory))
        return started[-1]

    monkeypatch.setattr(link, "_start_server", first_one_is_killed)
    with Board() as board:
        assert board.get(7) == 0
    assert [process.wait(30) for process in started] == [-signal.SIGINT, 0]


def test_temporary_board_leaves_no_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINIROSPY_BOARD_TEMPORARY", "1")
    directory = BoardDirectory.find()
    with Board() as board:
        board.press(11)
        assert directory.lock_path.exists()
    wait_until_gone(directory)
    assert not [*directory.folder.glob(f"{directory.name}.*")]


def test_kept_board_outlives_a_temporary_use(monkeypatch: pytest.MonkeyPatch) -> None:
    directory = BoardDirectory.find()
    with Board():
        pass
    wait_until_gone(directory)
    monkeypatch.setenv("MINIROSPY_BOARD_TEMPORARY", "1")
    with Board():
        pass
    wait_until_gone(directory)
    assert directory.state_path.exists()
