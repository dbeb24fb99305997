"""Functions that the cases in this folder use to print. It runs under real rospy and minirospy, so it uses only public names.

A case is a user's program; its output is the same under both, line by line, after numbers that differ between runs
(ports, process ids, wall-clock times, temporary folders) are replaced by a word.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

_MASKS = [
    (re.compile(r"(?:/[\w.-]+)+/referee/"), "<here>/"),
    (re.compile(r"http://[\w.-]+:\d+/?"), "<uri>"),
    (re.compile(r"rosrpc://[\w.-]+:\d+"), "<rosrpc>"),
    (re.compile(r"(?:127\.0\.0\.1|localhost)(?:'?, |:)\d+"), "<address>"),
    (re.compile(r"_\d+_\d{13,19}"), "<anonymous>"),
    (re.compile(r"\b1[5-9]\d{8}\.\d+"), "<time>"),
    (re.compile(r"0x[0-9a-f]{6,}"), "<id>"),
    (re.compile(r"\d+\.\d+ms"), "<ms>"),
    (re.compile(r"Pid: \d+"), "Pid: <pid>"),
    (re.compile(r"/tmp/[\w./-]+"), "<file>"),
]
_lock = threading.Lock()


def show(*values: object) -> None:
    """Print a line, with parts that differ between runs replaced."""
    text = " ".join(map(str, values))
    for pattern, word in _MASKS:
        text = pattern.sub(word, text)
    with _lock:
        sys.stdout.write(text + "\n")
        sys.stdout.flush()


def outcome(label: str, call: Callable[[], Any]) -> None:
    """Print a call's result: its value, or the type and text of its exception."""
    try:
        value = call()
    except Exception as error:  # noqa: BLE001 - any error is printed
        show(label, "raises", type(error).__name__, "|", str(error))
    else:
        show(label, "gives", repr(value))


def printed(label: str, call: Callable[[], Any], *masks: tuple[str, str], texts: bool = True) -> None:
    """Print a call's result, its stdout, and whether it prints to stderr.

    ``masks``: pattern and word for output that differs each time. Without ``texts``, only an error's type is printed.
    """
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()) as errors:
        try:
            value = repr(call())
        except SystemExit as error:
            value = f"SystemExit {error.code}"
        except Exception as error:  # noqa: BLE001 - any error is printed
            value = f"{type(error).__name__}: {error}" if texts else type(error).__name__
    text = out.getvalue()
    for pattern, word in masks:
        text = re.sub(pattern, word, text)
    show(label, value, repr(text), bool(errors.getvalue()))


class Other:
    """Another program on the same stack, which runs ``code``. ``read()`` returns its next line, ``close()`` stops it."""

    def __init__(self, code: str, *arguments: str, environment: dict[str, str] | None = None) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", code, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **(environment or {})},
        )

    def read(self) -> str:
        """Return the next line that it prints."""
        assert self.process.stdout
        return self.process.stdout.readline().rstrip("\n")

    def close(self, seconds: float = 30.0) -> int:
        """Close its stdin, and interrupt it if it does not exit in time; return its exit status."""
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.close()
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.process.terminate()
        try:
            return self.process.wait(30.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()
        finally:
            self.process.stdout.close()


def of_ten_looks(look: Callable[[], tuple[bool, ...]]) -> tuple[bool, ...]:
    """Call ``look()`` until its whole result is true, at most ten times; return the result.

    This is for durations, which are longer if the machine stalls occasionally, but not ten times in a row.
    """
    for _ in range(10):
        found = look()
        if all(found):
            break
    return found


def is_waiting(thread: threading.Thread) -> bool:
    """Return whether a thread waits for a condition or an event, as in rospy.sleep() with simulated time."""
    frame, names = sys._current_frames().get(thread.ident or 0), set()
    while frame:
        names.add(frame.f_code.co_name)
        frame = frame.f_back
    return "wait" in names


def eventually(condition: Callable[[], bool], seconds: float = 30.0) -> bool:
    """Return whether a condition becomes true within some seconds."""
    waiting = threading.Event()
    for _ in range(int(seconds / 0.02)):
        if condition():
            return True
        waiting.wait(0.02)
    return False
