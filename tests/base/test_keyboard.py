"""The terminal of a program, of a node that shares roslaunch's, and of a program in the background."""

from __future__ import annotations

import os
import select
import subprocess
import sys
from collections.abc import Iterator
from io import FileIO
from pathlib import Path

import pytest

from minirospy.base.keyboard import Keys, kept_terminal

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no terminal sessions")

PROGRAM = """import os, sys
from minirospy.base.keyboard import has_own_terminal
if "controlled" in sys.argv:
    os.setsid()
    import fcntl, termios
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
with open(sys.argv[1], "w") as file:
    file.write(str(has_own_terminal(sys.argv)))
"""


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], True),
        (["__log:=/tmp/a.log"], False),  # a node of roslaunch
        (["controlled", "__log:=/tmp/a.log"], True),  # with the launch-prefix `xterm -e`
    ],
)
def test_a_program_draws_on_its_own_terminal_only(words: list[str], expected: bool, tmp_path: Path) -> None:
    import pty

    ours, theirs = pty.openpty()
    try:
        command = [sys.executable, "-c", PROGRAM, str(tmp_path / "said"), *words]
        subprocess.run(command, stdin=theirs, stdout=theirs, check=True, timeout=60)
    finally:
        os.close(ours)
        os.close(theirs)
    assert (tmp_path / "said").read_text() == str(expected)


@pytest.fixture
def keyboard(monkeypatch: pytest.MonkeyPatch) -> Iterator[FileIO]:
    """Make stdin a terminal; return the file of its keyboard."""
    import pty

    user, terminal = pty.openpty()
    with os.fdopen(user, "wb", buffering=0) as keys, os.fdopen(terminal) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        yield keys


@pytest.mark.timeout(60)
def test_key_that_another_process_reads_is_not_waited_for(
    keyboard: FileIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    wait = select.select

    def wait_and_lose(*args: object) -> object:
        found = wait([sys.stdin], [], [])
        os.read(sys.stdin.fileno(), 1)
        return found

    with Keys() as keys:
        keyboard.write(b"a")
        with monkeypatch.context() as patched:
            patched.setattr(select, "select", wait_and_lose)
            assert keys.next() == ""
        keyboard.write(b"b")
        wait([sys.stdin], [], [])
        assert keys.next() == "b"


def test_settings_of_a_terminal_are_restored_after_a_program_that_left_its_own(keyboard: FileIO) -> None:
    import termios
    import tty

    before = termios.tcgetattr(sys.stdin)
    with kept_terminal():
        tty.setcbreak(sys.stdin)
        assert termios.tcgetattr(sys.stdin) != before
    assert termios.tcgetattr(sys.stdin) == before


SHELL = """import fcntl, os, subprocess, sys, termios
os.setsid()
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
code = "from minirospy.base.keyboard import may_read_stdin; print(may_read_stdin())"
for preexec in (None, os.setpgrp):  # in the foreground, and as with `&`
    subprocess.run([sys.executable, "-c", code], check=True, preexec_fn=preexec)
"""


def test_children_of_a_background_process_leave_the_shells_input_alone() -> None:
    import pty

    user, terminal = pty.openpty()
    try:
        done = subprocess.run(
            [sys.executable, "-c", SHELL],
            stdin=terminal,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
            timeout=60,
        )
    finally:
        os.close(user)
        os.close(terminal)
    assert done.stdout == "True\nFalse\n"
