"""Read single keys typed in a terminal, on every system."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
import time
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import ClassVar

__all__ = [
    "LOOK_SECONDS",
    "Keys",
    "has_own_terminal",
    "is_in_background",
    "kept_terminal",
    "may_read_stdin",
    "read_without_waiting",
    "shares_terminal",
]

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
                read_without_waiting(sys.stdin.fileno())
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
        # Bypass Python's buffer, which select does not see.
        try:
            key = os.read(sys.stdin.fileno(), 1).decode("ascii", "replace")
        except OSError:
            return self._end
        if not key:
            # Another process has read the key, or the terminal is closed.
            return "" if sys.stdin.isatty() else self._end
        if key != "\x1b":
            return key
        # Read the rest of the key without waiting: the bytes of a key arrive together.
        ready, _, _ = select.select([sys.stdin], [], [], 0)
        sequence = os.read(sys.stdin.fileno(), 2).decode("ascii", "replace") if ready else ""
        return self._ARROWS.get(sequence[-1:], "")


def has_own_terminal(argv: Sequence[str]) -> bool:
    """Return whether stdin and stdout are terminals, and a program with the command line ``argv`` may draw on them."""
    are_terminals = all(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stdout))
    return are_terminals and not shares_terminal(argv)


def shares_terminal(argv: Sequence[str]) -> bool:
    """Return whether a program whose stdin is a terminal is a node of roslaunch, which shares it with other nodes.

    Such a node has a ``__log:=`` argument, and its stdin is not its controlling terminal. With a launch-prefix such as
    ``xterm -e``, the node has its own terminal.
    """
    if sys.platform == "win32" or not any(word.startswith("__log:=") for word in argv):
        return False
    try:
        os.tcgetpgrp(sys.stdin.fileno())
    except OSError:
        return True
    return False


def is_in_background(number: int) -> bool:
    """Return whether the system would suspend this process if it read from the terminal ``number``.

    Return False for a process outside of the terminal's session, such as a node of roslaunch: the system never suspends it.
    Raise OSError if the terminal is closed.
    """
    if sys.platform == "win32":
        return False
    try:
        return os.tcgetpgrp(number) != os.getpgrp()
    except OSError as error:
        if error.errno == errno.ENOTTY:
            return False
        raise


def may_read_stdin() -> bool:
    """Return whether child processes may read this process's stdin: not if it belongs to a shell that started this with `&`."""
    # Without a stdin, the first file that this process opened may have its descriptor.
    if sys.__stdin__ is None:
        return False
    try:
        return not (os.isatty(0) and is_in_background(0))
    except OSError:
        return False


def read_without_waiting(number: int) -> None:
    """Make reads from the terminal ``number``, in single-key mode, return no bytes if there are none.

    Otherwise, of two processes that read one terminal, the one that comes too late would wait for the next key.
    """
    if sys.platform != "win32":
        import termios

        mode = termios.tcgetattr(number)
        mode[6][termios.VMIN] = mode[6][termios.VTIME] = 0
        termios.tcsetattr(number, termios.TCSANOW, mode)


@contextlib.contextmanager
def kept_terminal() -> Iterator[None]:
    """At the end, restore the settings that stdin's terminal has now: programs that were killed have left theirs."""
    if sys.platform == "win32" or sys.stdin is None or sys.stdin.closed or not sys.stdin.isatty():
        yield
        return
    import termios

    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)
    try:
        yield
    finally:
        # The terminal's window may be closed, and only a process in the foreground may change the settings.
        with contextlib.suppress(OSError, termios.error):
            if not is_in_background(number):
                termios.tcsetattr(number, termios.TCSADRAIN, before)
