"""Read single keys typed in a terminal, on every system."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Sequence
from types import TracebackType
from typing import ClassVar

__all__ = ["LOOK_SECONDS", "Keys", "has_own_terminal"]

LOOK_SECONDS = 0.05  # seconds for which Keys.next waits for a key


class Keys:
    """Reads single keys from the terminal, without Enter and without echo. If stdin is not a terminal, there are no keys."""

    _ARROWS: ClassVar = {"A": "up", "B": "down", "C": "right", "D": "left"}
    _WINDOWS_ARROWS: ClassVar = {"H": "up", "P": "down", "M": "right", "K": "left"}

    def __init__(self, *, end: str = "q") -> None:
        """Start reading keys. :meth:`next` returns ``end`` when the terminal is closed."""
        self._end = end
        self._is_closed = False
        self.is_terminal = sys.stdin is not None and sys.stdin.isatty()

    def __enter__(self) -> Keys:
        if sys.platform != "win32" and self.is_terminal:
            import termios
            import tty

            try:
                self._before = termios.tcgetattr(sys.stdin)
                tty.setcbreak(sys.stdin)
            except termios.error:
                # The terminal window has been closed.
                self._is_closed = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if sys.platform != "win32" and self.is_terminal and not self._is_closed:
            import termios

            # Ignore errors, because the terminal cannot be restored if its window is closed.
            with contextlib.suppress(termios.error):
                termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)

    def next(self) -> str:
        """Return the typed key (an arrow key by its name), or "" if no key is typed within LOOK_SECONDS."""
        if not self.is_terminal:
            time.sleep(LOOK_SECONDS)
            return ""
        if self._is_closed:
            return self._end
        if sys.platform == "win32":
            import msvcrt

            if msvcrt.kbhit():
                key = msvcrt.getwch()
                return self._WINDOWS_ARROWS.get(msvcrt.getwch(), "") if key in "\x00\xe0" else key
            time.sleep(LOOK_SECONDS)
            return ""
        import select

        ready, _, _ = select.select([sys.stdin], [], [], LOOK_SECONDS)
        if not ready:
            return ""
        # Bypass Python's buffer, which select does not see. A read that returns no bytes means that the terminal is closed.
        try:
            key = os.read(sys.stdin.fileno(), 1).decode("ascii", "replace")
        except OSError:
            return self._end
        if key != "\x1b":
            return key or self._end
        # Read the rest of the key without waiting: the bytes of a key arrive together.
        ready, _, _ = select.select([sys.stdin], [], [], 0)
        sequence = os.read(sys.stdin.fileno(), 2).decode("ascii", "replace") if ready else ""
        return self._ARROWS.get(sequence[-1:], "")


def has_own_terminal(argv: Sequence[str]) -> bool:
    """Return whether stdin and stdout are terminals, and a program with the command line ``argv`` may draw on them.

    A node of roslaunch has roslaunch's terminal, which other nodes use, too. Such a node has a ``__log:=`` argument, and the
    terminal does not control its session, unless a launch-prefix such as ``xterm -e`` opens another one.
    """
    if any(stream is None or not stream.isatty() for stream in (sys.stdin, sys.stdout)):
        return False
    if sys.platform == "win32" or not any(word.startswith("__log:=") for word in argv):
        return True
    try:
        os.tcgetpgrp(sys.stdin.fileno())
    except OSError:
        return False
    return True
