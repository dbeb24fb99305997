"""`roslaunch --check` and the table of `--ui`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.ros.roslaunch.commands import roslaunch
from tests.ros.roslaunch.conftest import BIN


def test_every_fault_is_reported_with_its_line(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    inner = package / "inner.launch"
    inner.write_text('<launch>\n<param name="p" value="$(env NO_SUCH)"/>\n</launch>')
    file = package / "a.launch"
    file.write_text(
        f'<launch>\n<nod/>\n<node name="a" pkg="pkg" type="wai.py"/>\n<node name="b" pkg="pkg" type="wait.py" machine="m"/>\n'
        f'<param name="x"/>\n<include file="{inner}"/>\n<param name="y" value="1" valu="2"/>\n</launch>'
    )
    assert roslaunch.main(["--check", str(file), "k:=1"]) == 1
    said = capsys.readouterr().out

    for line in (
        f"{file}:2: warning: unrecognized tag <nod>: did you mean <node>?\n",
        f"{file}:3: error: node [a]: executable [wai.py] not found; did you mean wait.py?",
        f"{file}:4: error: unknown machine [m]\n",
        f"{file}:5: error: <param> tag must have one and only one of",
        f"{file}:7: warning: unknown <param> attribute 'valu': did you mean value?\n",
        f"{inner}:2: error: environment variable 'NO_SUCH' is not set\n",
        f"{file}: error: arg [k] not found",
        "2 files, 2 nodes, 1 parameters: 5 errors, 2 warnings\n",
    ):
        assert line in said

    file.write_text('<launch><node name="a" pkg="pkg" type="wait.py"/></launch>')
    assert roslaunch.main(["--check", str(file)]) == 0
    assert capsys.readouterr().out == "1 files, 1 nodes, 0 parameters: 0 errors, 0 warnings\n"


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are Unix")
def test_the_table_on_a_terminal(package: Path, master: str) -> None:
    import pty

    file = package / "a.launch"
    file.write_text('<launch><node name="a" pkg="pkg" type="wait.py" args="here"/></launch>')
    above, below = pty.openpty()
    process = subprocess.Popen(
        [str(BIN / "roslaunch"), "--ui", str(file)],
        stdout=below,
        stderr=below,
        env={**os.environ, "COLUMNS": "120", "TERM": "xterm"},
    )
    os.close(below)
    # Read bytes: a read may end in the middle of a character.
    said = b""
    while b"waiting here" not in said:
        said += os.read(above, 4096)
    assert b"running" in said
    process.send_signal(signal.SIGINT)
    try:
        while b"done" not in said:
            said += os.read(above, 4096)
    except OSError:
        pass
    assert process.wait(30) == 0
    os.close(above)


def test_the_table_needs_a_terminal(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (package / "a.launch").write_text("<launch/>")
    assert roslaunch.main(["--ui", str(package / "a.launch")]) == 2
    assert "--ui draws on a terminal" in capsys.readouterr().err
