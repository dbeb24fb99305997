"""roslaunch's messages: prints them on the terminal in ROS's colours, and writes them to its log file."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

from minirospy.base import private_files

__all__ = ["ERROR", "INFO", "Output", "warn_of_large_logs"]

_BOLD, _RED, _PLAIN = "\033[1m", "\033[31m", "\033[0m"
_LARGE = 1024**3
INFO, ERROR = 2, 8  # rosgraph_msgs/Log levels


class Output:
    """Prints lines to stdout and stderr, with colours and titles on a terminal.

    ``listener`` also receives (level, text) for each line; a child roslaunch uses it to send the lines to its parent. If
    ``title`` is False, the terminal's title is not set. ``has_color`` is determined when a line is printed.
    """

    handlers: ClassVar[list[Callable[[int, str], None]]] = []
    """The user program's functions to call with (level, text) for each line."""

    def __init__(self, *, title: bool = True, listener: Callable[[int, str], None] | None = None) -> None:
        self._may_title = title
        self._listener = listener
        self._log: Path | None = None
        self._unlogged: list[str] = []

    def print(self, text: str = "", *, bold: bool = False) -> None:
        """Print a line to stdout."""
        self._write(text, _BOLD if bold else "", INFO)

    def warn(self, text: str) -> None:
        """Print a line to stderr, in red on a terminal."""
        self._write(text, _RED, ERROR)

    def title(self, text: str) -> None:
        """Set the terminal's title."""
        if self._may_title and sys.stdout.isatty():
            with contextlib.suppress(OSError):
                print(f"\033]2;{text}\007", end="", flush=True)

    def log_to(self, folder: Path) -> Path:
        """Write all lines, including earlier ones, to roslaunch-HOST-PID.log in ``folder``; return the file's path.

        Raise OSError if the file cannot be written.
        """
        path = folder / f"roslaunch-{socket.gethostname()}-{os.getpid()}.log"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with private_files.open_text(path, "w") as file:
                file.write("".join(self._unlogged))
            self._log = path
        finally:
            self._unlogged.clear()
        return path

    def _write(self, text: str, colour: str, level: int) -> None:
        stream = sys.stderr if level == ERROR else sys.stdout
        # Write each line in one call: nodes write to the same terminal.
        shown = f"{colour}{text}{_PLAIN}" if colour and stream.isatty() else text
        # Continue without the line if the reader (`| head`) has exited, the terminal was closed, or the disk is full:
        # the nodes must keep running, or be terminated in the right order.
        with contextlib.suppress(OSError):
            stream.write(shown + "\n")
            stream.flush()
        if text:
            self._to_log(text, level)
            for hear in filter(None, (self._listener, *self.handlers)):
                hear(level, text)

    def _to_log(self, text: str, level: int) -> None:
        stamp = time.strftime("%Y-%m-%d %H:%M:%S")
        line = f"[roslaunch][{'ERROR' if level == ERROR else 'INFO'}] {stamp}: {text}\n"
        if self._log is None:
            self._unlogged.append(line)
            return
        with contextlib.suppress(OSError), private_files.open_text(self._log, "a") as file:
            file.write(line)


def warn_of_large_logs(folder: Path, output: Output) -> None:
    """Warn if the log folder exceeds one gigabyte, measuring its size in the background."""

    def look() -> None:
        size = 0
        for path, _, names in os.walk(folder):
            for name in names:
                with contextlib.suppress(OSError):
                    size += os.stat(os.path.join(path, name)).st_size
        if size > _LARGE:
            what = f"disk usage in log directory [{folder}] is over {size // _LARGE}GB."
            output.warn(f"WARNING: {what}\nIt's recommended that you use the 'rosclean' command.")

    threading.Thread(target=look, daemon=True).start()
