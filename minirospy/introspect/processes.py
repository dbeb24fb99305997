"""Measures the CPU and memory use of local processes, which rqt_top shows for nodes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from typing import NamedTuple

import psutil

__all__ = ["ProcessLoad", "ProcessLoads"]


class ProcessLoad(NamedTuple):
    """``cpu``: percent of one core since the previous call (None on the first); ``memory``: resident memory in bytes."""

    cpu: float | None
    memory: int
    threads: int


class ProcessLoads:
    """Measures the CPU load and memory of processes between calls."""

    def __init__(self) -> None:
        self.known: dict[int, psutil.Process] = {}

    def look(self, pids: Iterable[int]) -> dict[int, ProcessLoad]:
        """Return the load of each process, keyed by ID. Omit processes that have exited or that this user may not inspect."""
        before, self.known = self.known, {}
        found = {}
        for pid in set(pids):
            with contextlib.suppress(psutil.Error, ValueError):
                process = before.get(pid)
                # The ID may have been reused after the process exited.
                is_new = process is None or not process.is_running()
                if process is None or is_new:
                    process = psutil.Process(pid)
                with process.oneshot():
                    cpu = process.cpu_percent()
                    load = ProcessLoad(
                        None if is_new else cpu, process.memory_info().rss, process.num_threads()
                    )
                self.known[pid] = process
                found[pid] = load
        return found
