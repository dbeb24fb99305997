"""CPU and memory of processes of this machine, as rqt_top shows those of nodes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from typing import NamedTuple

import psutil

__all__ = ["ProcessLoad", "ProcessLoads"]


class ProcessLoad(NamedTuple):
    """CPU in percent of one core since the last look, None at the first; memory (resident) in bytes."""

    cpu: float | None
    memory: int
    threads: int


class ProcessLoads:
    """Looks at processes again and again."""

    def __init__(self) -> None:
        self._known: dict[int, psutil.Process] = {}

    def look(self, pids: Iterable[int]) -> dict[int, ProcessLoad]:
        """Return the loads of processes by their ids, without those that do not run or that may not be looked at."""
        before, self._known = self._known, {}
        found = {}
        for pid in set(pids):
            with contextlib.suppress(psutil.Error, ValueError):
                process = before.get(pid)
                # The id of a process that has ended may be another's.
                is_new = process is None or not process.is_running()
                if process is None or is_new:
                    process = psutil.Process(pid)
                with process.oneshot():
                    cpu = process.cpu_percent()
                    load = ProcessLoad(
                        None if is_new else cpu, process.memory_info().rss, process.num_threads()
                    )
                self._known[pid] = process
                found[pid] = load
        return found
