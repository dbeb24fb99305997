"""Killing launchers many times, and Ctrl-C in a console, as Wine delivers it."""

from __future__ import annotations

import itertools
import os
import sys
import threading
from pathlib import Path

import pytest

from tests.conftest import write_files
from tests.windows.programs import MANIFEST, SECONDS, WAIT, WINDOWS, Start, command, no_process_left

LAUNCHES = 50
TOGETHER = 5
MOMENTS = ("Starting", "1: button 1 pressed", "2: button 1 pressed")

if sys.platform != "win32":
    import pty


@pytest.mark.timeout(3000)
def test_fifty_launches_ended_by_force_leave_no_process(start: Start) -> None:
    """Run `minirospy demo`, five at a time; kill it while it starts, when its nodes are running, and in between."""
    killed = 0
    moments = itertools.cycle(MOMENTS)
    while killed < LAUNCHES:
        # Each has a separate board.
        runs = [start(command("minirospy"), "demo", MINIROSPY_BOARD="") for _ in range(TOGETHER)]
        for run in runs:
            # On a very busy machine, a demo may give up before its nodes are running; it then does not count.
            killed += run.reaches(next(moments))
            run.close()
        no_process_left()


@pytest.mark.skipif(sys.platform == "win32", reason="Wine's console is a terminal of Linux")
def test_ctrl_c_in_the_console_ends_roslaunch_and_its_nodes(place: Path, environ: dict[str, str]) -> None:
    launch = '<launch><node pkg="pkg" type="wait.py" name="a" output="screen"/></launch>'
    write_files(place / "pkg", {"package.xml": MANIFEST, "wait.py": WAIT, "a.launch": launch})
    terminal, console = pty.openpty()
    process = WINDOWS.popen(
        command("roslaunch"),
        "pkg",
        "a.launch",
        folder=place,
        environ={**environ, "TERM": "xterm"},
        console=console,
    )
    os.close(console)
    printed = _Terminal(terminal)
    try:
        printed.until("waiting")
        os.write(terminal, b"\x03")
        printed.until("shutting down processing monitor complete")
        assert process.wait(SECONDS) == 0
        no_process_left()
    finally:
        process.kill()
        process.wait()
        printed.close()


class _Terminal:
    """Reads the output of programs on a pseudo terminal."""

    def __init__(self, file: int) -> None:
        self._file = file
        self._changed = threading.Condition()
        self._said = ""
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def until(self, words: str) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: words in self._said, SECONDS), self._said

    def close(self) -> None:
        self._thread.join(SECONDS)
        os.close(self._file)

    def _read(self) -> None:
        while True:
            try:
                data = os.read(self._file, 65536)
            except OSError:
                # The last program has closed its side.
                return
            if not data:
                return
            with self._changed:
                self._said += data.decode(errors="replace")
                self._changed.notify_all()
