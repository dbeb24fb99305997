"""Shows the progress of long rosbag commands: a bar on a terminal, ROS's text in a pipe, nothing if quiet."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Callable, Iterator

from minirospy.base.escape import escaped, own_output

__all__ = ["showing_progress"]

_REFRESH = 1.0
_BESIDE_PATH = 37  # number of columns of ROS's progress line, without the path


@contextlib.contextmanager
def showing_progress(path: str, total: int, *, quiet: bool) -> Iterator[Callable[[int], None]]:
    """Yield a function that displays the progress, given the number of bytes done out of ``total``.

    The output ends with a newline, even if the block raises an exception.
    """
    if quiet:
        yield lambda done: None
    elif sys.stdout.isatty():
        with _bar(path, total) as step:
            yield step
    else:
        meter = _Meter(path, total)
        try:
            yield meter.step
        except BaseException:
            # End the progress line, so that the next message is on a new line.
            print()
            raise
        meter.finish()


@contextlib.contextmanager
def _bar(path: str, total: int) -> Iterator[Callable[[int], None]]:
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        DownloadColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    # Write to the original stdout: the commands' wrapped one escapes the control sequences that move the bar's cursor.
    console = Console(file=own_output())
    with Progress(*columns, console=console, redirect_stdout=False, redirect_stderr=False) as progress:
        task = progress.add_task(escaped(path), total=max(total, 1))
        yield lambda done: progress.update(task, completed=done)
        progress.update(task, completed=max(total, 1))


class _Meter:
    """ROS's progress line, rewritten every second."""

    def __init__(self, path: str, total: int) -> None:
        width = int(os.environ.get("COLUMNS", "") or 80) if os.environ.get("COLUMNS", "80").isdigit() else 80
        self._width = width - _BESIDE_PATH
        self._path = path if len(path) <= self._width else "..." + path[3 - self._width :]
        self._total = total
        self._start = self._shown = time.monotonic()
        self._show(0)

    def step(self, done: int) -> None:
        now = time.monotonic()
        if now - self._shown > _REFRESH:
            self._show(done)
            self._shown = now

    def finish(self) -> None:
        self._show(self._total)
        print()

    def _show(self, done: int) -> None:
        elapsed = time.monotonic() - self._start
        total = _human(self._total)
        if done < self._total:
            fraction = done / self._total
            text = (
                f"{int(100 * fraction):3}% {_human(done):>8} / {total:>8} {_remaining(elapsed, fraction)} ETA"
            )
        else:
            text = f"100% {total:>19} {int(elapsed / 60):02}:{int(elapsed % 60):02}    "
        print("\r", f"{self._path:<{self._width}} {text}", end="", flush=True)


def _remaining(elapsed: float, fraction: float) -> str:
    if fraction <= 0.0:
        return "--:--"
    seconds = elapsed * (1.0 / fraction - 1.0)
    return "--:--" if seconds / 60 > 99 else f"{int(seconds / 60):02}:{int(seconds % 60):02}"


def _human(size: float) -> str:
    for unit in ("KB", "MB", "GB", "TB", "PB", "EB"):
        size /= 1024.0
        if size < 1024.0:
            return f"{size:.1f} {unit}"
    return f"{size:.1f} EB"
