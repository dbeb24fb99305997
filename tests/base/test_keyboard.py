"""The terminal of a program, and of a node that shares roslaunch's."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

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
