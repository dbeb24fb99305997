"""`minirospy board` as scripts use it."""

from __future__ import annotations

import contextlib
import io
import itertools
import os
import select
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from minirospy.base.installation import install_command
from minirospy.board.board import Board
from minirospy.board.raspberry import model_name, warn_of_missing_library
from minirospy.board.rpigpio import BCM, IN, OUT, PUD_UP, Gpio
from minirospy.cli.board import main, render


def test_press_get_release(capsys: pytest.CaptureFixture[str]) -> None:
    assert [main(["press", "11"]), main(["get", "11", "12"]), main(["release", "11"])] == [0, 0, 0]
    assert main(["get", "11"]) == 0
    assert capsys.readouterr().out.split() == ["1", "0", "0"]


def test_set_and_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["set", "7", "1"]) == 0
    assert main(["set", "17", "1"]) == 0
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "pin level function pull part"
    assert "  7 1     in       off  red LED" in lines
    assert " 17 1     in       off" in lines


@pytest.mark.parametrize(
    ("words", "status", "complaint"),
    [
        (["press", "99"], 1, "pin 99 does not exist: BCM numbers are 0 to 53"),
        (["press", "x"], 2, "invalid int value: 'x'"),
        (["press"], 2, "the following arguments are required: pin"),
        # Newer Python versions quote the value.
        (["set", "7", "2"], 2, "argument level: invalid choice: "),
        (["presss", "7"], 2, "did you mean press?"),
    ],
)
def test_complaints(
    words: list[str], status: int, complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == status
    said = capsys.readouterr().err
    assert said.startswith("minirospy board: ERROR: ")
    assert complaint in said
    assert len(said.splitlines()) == 1


def test_watch_prints_a_line_for_each_edge() -> None:
    code = "import sys; from minirospy.cli.board import main; sys.exit(main(sys.argv[1:]))"
    with (
        Board() as board,
        subprocess.Popen(
            [sys.executable, "-c", code, "watch", "7", "-n", "2"], stdout=subprocess.PIPE, text=True
        ) as child,
    ):
        # The test cannot tell when the listener is ready, so toggle the pin until the listener has received enough edges.
        for number in itertools.count(1):
            board.set(7, number % 2)
            try:
                child.wait(0.05)
                break
            except subprocess.TimeoutExpired:
                pass
        assert child.stdout is not None
        assert sorted(child.stdout.read().splitlines()) == ["7 0", "7 1"]
        assert child.returncode == 0


def test_reset(capsys: pytest.CaptureFixture[str]) -> None:
    main(["list"])
    new = capsys.readouterr().out
    program = Gpio()
    program.setmode(BCM)
    program.setup(7, OUT, initial=1)
    program.setup(20, IN, pull_up_down=PUD_UP)
    program.close()
    for words in ("press 11", "set 21 1", "person 0.3"):
        assert main(words.split()) == 0
    main(["list"])
    assert capsys.readouterr().out != new
    assert main(["reset"]) == 0
    main(["list"])
    main(["person"])
    assert capsys.readouterr().out == f"{new}away\n"


def test_press_warns_if_no_button_is_wired(capsys: pytest.CaptureFixture[str]) -> None:
    program = Gpio()
    program.setmode(BCM)
    program.setup(20, IN, pull_up_down=PUD_UP)
    assert main(["press", "11", "20"]) == 0
    assert capsys.readouterr().err == ""
    assert main(["press", "1", "2"]) == 0
    program.close()
    assert capsys.readouterr().err == (
        "WARNING: GPIO 1 has no button, nothing is wired to it: the buttons are GPIO 11 and 12\n"
        "WARNING: GPIO 2 has no button, it is wired to a green LED: the buttons are GPIO 11 and 12\n"
    )


def test_without_a_terminal_it_prints_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert capsys.readouterr().out.startswith("pin level function pull part")


@pytest.mark.parametrize(("encoding", "lit", "dark"), [("utf-8", "●", "○"), ("ascii", "(*)", "( )")])
def test_picture(encoding: str, lit: str, dark: str) -> None:
    paper = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    with Board() as board:
        board.press(11)
        board.set(7, 1)
        Console(file=paper, width=80).print(render(board.state()))
    paper.seek(0)
    text = paper.read()
    assert (text.count(lit), text.count(dark)) == (1, 5)
    assert all(f"GPIO {pin}" in text for pin in (2, 3, 4, 5, 6, 7, 11, 12))
    paper.close()


def test_real_raspberry_pi_is_warned_of_the_missing_library(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "model"
    warn_of_missing_library(file)
    file.write_bytes(b"Orange Pi\0")
    warn_of_missing_library(file)
    assert capsys.readouterr().err == ""
    file.write_bytes(b"Raspberry Pi 4 Model B Rev 1.4\0")
    assert model_name(file) == "Raspberry Pi 4 Model B Rev 1.4"
    warn_of_missing_library(file)
    assert install_command("minirospy[pi]") in capsys.readouterr().err


def test_the_person(capsys: pytest.CaptureFixture[str]) -> None:
    words = (["person"], ["person", "0.3", "-0.1"], ["person"], ["person", "away"], ["person"])
    assert [main(line) for line in words] == [0] * 5
    assert capsys.readouterr().out.splitlines() == [
        "away",
        "0.30 m ahead, 0.10 m right; nearest 0.17 m",
        "away",
    ]


@pytest.mark.parametrize(
    ("words", "status", "complaint"),
    [
        (["person", "here"], 2, "metres are numbers"),
        (["person", "away", "0"], 2, "metres are numbers"),
        (["person", "nan"], 1, "a position is two lengths in metres"),
        (["-b"], 2, "-b needs the name of a board"),
        (["-b", "../x", "list"], 1, "the board's name [../x]"),
    ],
)
def test_complaints_about_persons_and_boards(
    words: list[str], status: int, complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == status
    assert complaint in capsys.readouterr().err


def test_several_boards(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    own = os.environ["MINIROSPY_BOARD"]
    for words in (["press", "11"], ["-b", own + "-b", "get", "11"], ["-b", own, "get", "11"], ["boards"]):
        assert main(words) == 0
    monkeypatch.setenv("MINIROSPY_BOARD", own)
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ["0", "1"]
    assert {own, own + "-b"} <= set(lines[2:])


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_the_picture_of_a_person(encoding: str) -> None:
    paper = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    with Board() as board:
        board.move_person((0.5, 0.0))
        Console(file=paper, width=80).print(render(board.state()))
    paper.seek(0)
    lines = paper.read().splitlines()
    paper.close()
    body, scanner = ("█", "▲") if encoding == "utf-8" else ("#", "^")
    (top, *_, bottom) = [number for number, line in enumerate(lines) if body * 3 in line]
    (foot,) = [number for number, line in enumerate(lines) if scanner in line]
    # Each line is 0.1 m high; the person's body extends from 0.4 m to 0.6 m.
    assert (foot - top, foot - bottom) == (6, 4)


@pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal")
@pytest.mark.parametrize("kind", ["xterm", "dumb"])
def test_keys_press_buttons_and_move_the_person(
    kind: str, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    import pty

    monkeypatch.setenv("TERM", kind)
    ours, theirs = pty.openpty()
    code = "import sys; from minirospy.cli.board import main; sys.exit(main([]))"
    with Board() as board:
        child = subprocess.Popen([sys.executable, "-c", code], stdin=theirs, stdout=theirs, stderr=theirs)
        os.close(theirs)
        request.addfinalizer(lambda: (child.kill(), child.wait()))

        def type_until(keys: bytes, condition: Callable[[], bool]) -> None:
            os.write(ours, keys)
            while not condition():
                # Read the output; otherwise the program would block. The change may reach this process only after it was drawn.
                if select.select([ours], [], [], 0.05)[0]:
                    os.read(ours, 65536)

        os.read(ours, 1)
        type_until(b"1", lambda: board.get(11) == 1)
        type_until(b"p", lambda: board.person == (0.6, 0.0))
        type_until(b"\x1b[B\x1b[B\x1b[D", lambda: board.person == (0.5, 0.05))
        type_until(b"\x1b[A\x1b[C", lambda: board.person == (0.55, 0.0))
        type_until(b"p", lambda: board.person is None)
        type_until(b"1", lambda: board.get(11) == 0)
        os.write(ours, b"q")
        drawing = threading.Thread(target=_read_all, args=(ours,))
        drawing.start()
        assert child.wait(30) == 0
        drawing.join()
        os.close(ours)


def _read_all(terminal: int) -> None:
    """Read until the other end is closed, which Linux reports as an error."""
    with contextlib.suppress(OSError):
        while os.read(terminal, 65536):
            pass
