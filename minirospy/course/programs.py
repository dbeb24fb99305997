"""Programs that a check starts: their output is collected line by line, and Ctrl-C stops them."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import MinirospyError, NotFoundError, UsageError
from minirospy.workspace.packages import NotExecutableError, Packages, is_python

__all__ = ["Line", "Program", "find_command"]

_LAUNCH = (".launch", ".launch.xml", ".test")
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_MAX_LINES = 20_000  # maximum number of output lines to keep, because a program may print endlessly
_DIED = re.compile(r"\[([\w/.-]+?)(?:-\d+)?\] process has died \[pid \d+, exit code (-?\d+)")
_LINE_OF_FILE = re.compile(r'^\s+File "(.+)", line (\d+)')
_EXCEPTION = re.compile(r"[A-Za-z_][\w.]*(Error|Exception|Exit|Interrupt|Warning)?(:|$)")
_KILL_SECONDS = 5.0  # timeout in seconds for a killed process to exit, and for its output to end


class Line(NamedTuple):
    """A line of program output, with its time of arrival in seconds of the monotonic clock."""

    text: str
    time: float


def find_command(word: str, packages: Packages) -> list[str]:
    """Return the command that starts FILE or PACKAGE/PROGRAM. A launch file is started with roslaunch.

    Raise NotFoundError, with similar names, if it does not exist, or UsageError if it is not a program.
    """
    path = Path(word)
    if path.is_file():
        return _command_of(path)
    package, _, name = word.partition("/")
    if not name or word.startswith((".", "/", "~")) or path.is_absolute():
        raise NotFoundError("file", word, hint="name a file, or a program of a package as PACKAGE/PROGRAM")
    if name.endswith(_LAUNCH):
        return _command_of(packages.find_resource(package, name))
    try:
        return packages.find_executable(package, name)
    except NotExecutableError as error:
        raise UsageError(str(error)) from error


def _command_of(path: Path) -> list[str]:
    if path.name.endswith(_LAUNCH):
        # Without --screen, nodes without output="screen" would print to files, but the check needs their output.
        return [sys.executable, "-m", "minirospy.ros.roslaunch.commands.roslaunch", "--screen", str(path)]
    # An empty file without a shebang is a Python program if its name ends in .py.
    if is_python(path):
        return [sys.executable, str(path.resolve())]
    if os.access(path, os.X_OK) and path.suffix not in (".txt", ".yaml", ".md"):
        return [str(path.resolve())]
    raise UsageError(f"[{path}] is neither a Python program, a launch file nor an executable program")


class Program:
    """A program started by the check. ``name`` is its file name; ``is_work`` is true if the student wrote it."""

    def __init__(self, command: Sequence[str], environ: Mapping[str, str], *, is_work: bool) -> None:
        self.name = Path(command[-1]).name
        self.is_work = is_work
        self.is_launch = command[-1].endswith(_LAUNCH)
        self.started = time.monotonic()
        self.ignored_interrupt = False
        self._end = self.started
        self._lines: list[Line] = []
        self._lock = threading.Lock()
        windows = sys.platform == "win32"
        flags = subprocess.CREATE_NEW_PROCESS_GROUP if windows else 0  # type: ignore[attr-defined,unused-ignore]
        try:
            self.process = subprocess.Popen(
                list(command),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=dict(environ),
                start_new_session=not windows,
                creationflags=flags,
            )
        except OSError as error:
            raise MinirospyError(f"cannot run {command[0]}: {error.strerror}") from error
        self._reader = threading.Thread(target=self._read, name=f"output of {self.name}", daemon=True)
        self._reader.start()

    @property
    def status(self) -> int | None:
        """Return the exit status, or None while the program runs."""
        return self.process.poll()

    @property
    def lines(self) -> list[Line]:
        """Return the lines that the program has printed so far."""
        with self._lock:
            return list(self._lines)

    @property
    def ended_after(self) -> float:
        """Return how long a program ran before it exited, in seconds."""
        return self._end - self.started

    def wait_for_output(self) -> None:
        """Wait until all output of an exited program has been read."""
        self._reader.join(_KILL_SECONDS)

    def stop(self, patience: float) -> None:
        """Send Ctrl-C and wait. If the program does not exit within ``patience`` seconds, kill its process group. Idempotent."""
        if self.status is None:
            windows = sys.platform == "win32"
            interrupt = signal.CTRL_BREAK_EVENT if windows else signal.SIGINT  # type: ignore[attr-defined,unused-ignore]
            with contextlib.suppress(OSError):
                self.process.send_signal(interrupt)
            try:
                self.process.wait(patience)
            except subprocess.TimeoutExpired:
                self.ignored_interrupt = True
        self._kill()

    def fault(self) -> str:
        """Describe an error found in the program's output: a traceback, or roslaunch's message that a node has died.

        Return an empty string if there is none.
        """
        texts = [line.text for line in self.lines]
        what = exception_in(texts)
        if what:
            return what
        for text in texts:
            if found := _DIED.search(text):
                return f"the node {found[1]} ended with status {found[2]}"
        return ""

    def last_lines(self, count: int) -> list[str]:
        """Return the last non-empty lines of the output."""
        return [line.text for line in self.lines if line.text.strip()][-count:]

    def _kill(self) -> None:
        """Kill the program if it still runs, and all other processes in its group."""
        if sys.platform != "win32":
            with contextlib.suppress(OSError):
                os.killpg(self.process.pid, signal.SIGKILL)
        if self.status is None:
            self.process.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(_KILL_SECONDS)
        self._reader.join(_KILL_SECONDS)

    def _read(self) -> None:
        stream = self.process.stdout
        assert stream is not None
        with stream:
            for raw in stream:
                text = _COLOURS.sub("", raw.decode("utf-8", "replace").rstrip("\r\n"))
                with self._lock:
                    if len(self._lines) >= _MAX_LINES:
                        del self._lines[: _MAX_LINES // 2]
                    self._lines.append(Line(text, time.monotonic()))
        self._end = time.monotonic()


def exception_in(lines: Sequence[str]) -> str:
    """Return the last exception in a program's output and its location: ``NameError: ... (my_led.py, line 12)``.

    Return an empty string if there is none.
    """
    found, place = "", ""
    in_traceback = False
    for text in lines:
        if "Traceback (most recent call last)" in text:
            in_traceback, place = True, ""
        elif match := _LINE_OF_FILE.match(text):
            # Python prints a SyntaxError without a `Traceback` line.
            in_traceback = True
            if not _is_library(match[1]) or not place:
                place = f"{Path(match[1]).name}, line {match[2]}"
        elif in_traceback and text and not text[0].isspace() and _EXCEPTION.match(text):
            found = f"{text.strip()} ({place})" if place else text.strip()
            in_traceback = False
    return found


def _is_library(file: str) -> bool:
    """Return whether a file named in a traceback belongs to minirospy or Python rather than to the student."""
    parts = Path(file).parts
    return (
        "minirospy" in parts
        or "site-packages" in parts
        or any(part.startswith("python3") for part in parts)
        or file[:1] == "<"
    )
