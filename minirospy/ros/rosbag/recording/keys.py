"""Reads single keys from the terminal, or characters from a pipe, while a program runs."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Callable, Iterator

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.keyboard import is_in_background, read_without_waiting

__all__ = ["read_keys"]

_POLL_SECONDS = 0.05


@contextlib.contextmanager
def read_keys(on_key: Callable[[str], object]) -> Iterator[None]:
    """While the block runs, call ``on_key`` from a thread with each typed key. Ctrl-C still sends a signal.

    Read nothing if there is no standard input. Do not change the terminal while the process is in the background.
    """
    stop = SignalSafeEvent()
    reader: Callable[[Callable[[str], object], threading.Event], None] | None = None
    if sys.stdin is not None and not sys.stdin.closed:
        reader = _read_windows if sys.platform == "win32" else _read_posix
    thread = (
        threading.Thread(target=reader, args=(on_key, stop), name="keys", daemon=True) if reader else None
    )
    if thread:
        thread.start()
    try:
        yield
    finally:
        stop.set()
        if thread:
            # Wait until the thread has restored the terminal.
            thread.join(10.0)


def _read_posix(on_key: Callable[[str], object], stop: threading.Event) -> None:
    import select
    import termios

    # The terminal's window may be closed at any time.
    with contextlib.suppress(OSError, ValueError, termios.error):
        number = sys.stdin.fileno()
        terminal = _Terminal(number) if os.isatty(number) else None
        try:
            while not stop.is_set():
                if terminal and not terminal.set_up():
                    stop.wait(0.2)
                    continue
                if not select.select([number], [], [], _POLL_SECONDS)[0]:
                    continue
                data = os.read(number, 64)
                if not data and not (terminal and os.isatty(number)):
                    return
                for key in data.decode("utf-8", "replace"):
                    on_key(key)
        finally:
            if terminal:
                terminal.restore()


class _Terminal:
    """A terminal in single-key mode: keys arrive without Enter or echo while this process is in the foreground."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._before: list[object] | None = None

    def set_up(self) -> bool:
        """Switch the terminal to single-key input.

        Return False for a background process, which the system would suspend if it read from the terminal.
        """
        if is_in_background(self._number):
            self._before = None
            return False
        if self._before is None:
            import termios

            self._before = termios.tcgetattr(self._number)
            mode = termios.tcgetattr(self._number)
            mode[3] &= ~(termios.ICANON | termios.ECHO)
            termios.tcsetattr(self._number, termios.TCSANOW, mode)
            read_without_waiting(self._number)
        return True

    def restore(self) -> None:
        """Restore the terminal's settings."""
        if self._before is not None and not is_in_background(self._number):
            import termios

            termios.tcsetattr(self._number, termios.TCSANOW, self._before)  # type: ignore[arg-type]


def _read_windows(on_key: Callable[[str], object], stop: threading.Event) -> None:
    if sys.platform == "win32":
        import msvcrt

        while not stop.wait(_POLL_SECONDS):
            while msvcrt.kbhit():
                on_key(msvcrt.getwch())
