"""A package of plain scripts, and roslaunch as a process."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

BIN = Path(sys.executable).parent

# Write each line with a single call, because roslaunch writes to the same pipe at the same time.
WAIT = """import signal, sys, time
def stop(number, frame):
    sys.stdout.write(f'ended by {signal.Signals(number).name}\\n')
    sys.exit(0)
for name in ('SIGINT', 'SIGTERM'):
    signal.signal(getattr(signal, name), signal.SIG_IGN if name in sys.argv else stop)
sys.stdout.write(' '.join(['waiting', *sys.argv[1:]]) + '\\n')
sys.stdout.flush()
time.sleep(60)
"""
STOP = """import os, sys
sys.stdout.write(f'out {os.getcwd()} {os.environ.get("E")}\\n')
sys.stderr.write('err\\n')
sys.exit(int(sys.argv[1]))
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of package ``pkg``: wait.py waits, stop.py exits with the status in its first argument."""
    folder = tmp_path / "pkg"
    folder.mkdir()
    (folder / "package.xml").write_text("<package><name>pkg</name></package>")
    (folder / "wait.py").write_text(WAIT)
    (folder / "stop.py").write_text(STOP)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    return folder


class Running:
    """A running roslaunch."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process

    def read_until(self, *words: str) -> str:
        """Return the output up to the point at which all of ``words`` have been printed."""
        assert self.process.stdout
        said = ""
        for line in self.process.stdout:
            said += line
            if all(word in said for word in words):
                return said
        raise AssertionError(f"no {words} in:\n{said}")

    def children(self) -> list[psutil.Process]:
        """Return all processes that it started."""
        found: list[psutil.Process] = psutil.Process(self.process.pid).children(recursive=True)
        return found


Start = Callable[..., Running]


@pytest.fixture
def start(package: Path) -> Iterator[Start]:
    """Return a function that starts roslaunch with the text of a launch file, and options."""
    running: list[Running] = []

    def start(text: str, *options: str, stdin: int | None = None) -> Running:
        file = package / f"{len(running)}.launch"
        file.write_text(f"<launch>{text}</launch>")
        process = subprocess.Popen(
            [str(BIN / "roslaunch"), *options, str(file)],
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        running.append(Running(process))
        return running[-1]

    yield start
    for each in running:
        with contextlib.suppress(psutil.Error):
            for child in each.children():
                child.kill()
        each.process.kill()
        each.process.communicate()
