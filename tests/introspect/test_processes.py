"""CPU and memory of processes on this machine."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import psutil

from minirospy.introspect.processes import ProcessLoads


def test_load_of_a_process_matches_psutil() -> None:
    loads = ProcessLoads()
    first = loads.look([os.getpid()])[os.getpid()]
    assert first.cpu is None, "there is nothing to compare with"
    assert first.memory > 1_000_000
    assert first.threads >= threading.active_count()
    sum(range(200_000))
    second = loads.look([os.getpid(), os.getpid()])[os.getpid()]
    assert second.cpu is not None
    assert second.cpu >= 0


def test_processes_that_have_ended_are_left_out() -> None:
    loads = ProcessLoads()
    program = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    assert program.pid in loads.look([program.pid])
    program.communicate()
    assert loads.look([program.pid, 0, -1, 1 << 40]).keys() <= {0}
    assert program.pid not in loads.known


def test_process_with_a_reused_id_starts_from_zero() -> None:
    loads = ProcessLoads()
    loads.look([os.getpid()])
    # psutil reports another creation time if the process id now belongs to another process.
    loads.known[os.getpid()]._create_time = 1.0  # type: ignore[attr-defined]
    loads.known[os.getpid()]._ident = (os.getpid(), 1.0)  # type: ignore[attr-defined]
    assert loads.look([os.getpid()])[os.getpid()].cpu is None
    assert loads.known[os.getpid()] == psutil.Process()
