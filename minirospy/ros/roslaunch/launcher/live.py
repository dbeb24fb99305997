"""`roslaunch --ui`: shows the nodes in a table that is redrawn twice a second."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import psutil
from rich.console import Console
from rich.live import Live
from rich.table import Table

from minirospy.base.escape import own_output

if TYPE_CHECKING:
    from types import TracebackType

    from minirospy.ros.roslaunch.launcher.process import Process
    from minirospy.ros.roslaunch.launcher.runner import Launcher

__all__ = ["LiveTable", "Row", "last_line"]

_PICTURES_A_SECOND = 2
_TAIL_BYTES = 4096
_MEGABYTE = 1024 * 1024


class Row(NamedTuple):
    """A node's table row: CPU in percent of one core, memory in bytes, both including child processes."""

    name: str
    state: str
    pid: int
    cpu: float
    memory: int
    seconds: float
    restarts: int
    last_line: str


class LiveTable:
    """Shows a launcher's nodes as a table on the terminal, as a context manager."""

    def __init__(self, launcher: Launcher, console: Console | None = None) -> None:
        self._launcher = launcher
        self._known: dict[int, psutil.Process] = {}
        self._live = Live(
            get_renderable=self._table,
            console=console or Console(file=own_output()),
            refresh_per_second=_PICTURES_A_SECOND,
            vertical_overflow="visible",
        )

    def __enter__(self) -> LiveTable:
        self._live.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.__exit__(kind, value, trace)

    def rows(self) -> list[Row]:
        """Return the current rows, one per node."""
        return [self._row(process) for process in tuple(self._launcher.processes)]

    def _row(self, process: Process) -> Row:
        code = process.exit_code
        cpu, memory = self._load(process.pid) if code is None else (0.0, 0)
        state = "running" if code is None else "finished" if code == 0 else f"died ({code})"
        return Row(
            process.name,
            "ending" if process.is_ending and code is None else state,
            process.pid,
            cpu,
            memory,
            time.monotonic() - process.started,
            process.starts - 1,
            last_line(process.stdout_file),
        )

    def _load(self, pid: int) -> tuple[float, int]:
        cpu, memory = 0.0, 0
        with contextlib.suppress(psutil.Error):
            top = psutil.Process(pid)
            for each in (top, *top.children(recursive=True)):
                # Reuse psutil's object: it reports the CPU load since its previous call.
                known = self._known.setdefault(each.pid, each)
                with contextlib.suppress(psutil.Error):
                    cpu += known.cpu_percent()
                    memory += known.memory_info().rss
        return cpu, memory

    def _table(self) -> Table:
        table = Table(expand=True)
        for head in ("node", "state", "pid", "CPU %", "MB", "s", "restarts"):
            table.add_column(head, justify="left" if head in ("node", "state") else "right", no_wrap=True)
        table.add_column("last line", ratio=1, no_wrap=True, overflow="ellipsis")
        for row in self.rows():
            style = "" if row.state == "running" else "red" if row.state.startswith("died") else "dim"
            texts = (
                f"{row.cpu:.0f}",
                f"{row.memory / _MEGABYTE:.0f}",
                f"{row.seconds:.0f}",
                f"{row.restarts}",
            )
            table.add_row(row.name, row.state, str(row.pid), *texts, _plain(row.last_line), style=style)
        return table


def last_line(file: Path | None) -> str:
    """Return the last non-empty line of a file."""
    if file is None:
        return ""
    try:
        with file.open("rb") as stream:
            stream.seek(0, 2)
            stream.seek(max(0, stream.tell() - _TAIL_BYTES))
            lines = stream.read().decode("utf-8", "replace").splitlines()
    except OSError:
        return ""
    return next((line for line in reversed(lines) if line.strip()), "")


def _plain(text: str) -> str:
    """Remove control characters from a string and escape rich's markup."""
    return "".join(each for each in text if each.isprintable()).replace("[", r"\[")
