"""Stopping a launch's processes, and the guardian on systems that stop these processes themselves."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from minirospy.base.child_lifetime import guard_children
from minirospy.ros.roslaunch.launcher import guardian, process
from minirospy.ros.roslaunch.launcher.process import Timeouts, end_processes, start_process
from minirospy.ros.roslaunch.launcher.spec import NodeSpec

FOREVER = [sys.executable, "-c", "import time; time.sleep(600)"]


def test_a_process_that_no_interrupt_reaches_is_terminated_immediately(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On Windows without a console, no interrupt reaches the process; waiting its 600 seconds would be useless."""

    def refuse(_: object) -> None:
        raise OSError("Invalid handle")

    monkeypatch.setattr(process, "_interrupt", refuse)
    started = start_process("a", FOREVER, environ=os.environ)
    warnings: list[str] = []
    assert end_processes([started], Timeouts(600.0, 60.0), warnings.append) == []
    assert not started.is_running
    assert warnings == ["[a] escalating to SIGTERM"]


def test_the_guardian_leaves_processes_alone_that_the_system_ends() -> None:
    """Their process ids may belong to other processes by then."""
    words = [sys.executable, "-I", "-S", str(guardian.__file__), "0", "0", "http://localhost:1"]
    with subprocess.Popen(FOREVER) as other:
        try:
            subprocess.run(
                [*words, guardian.SYSTEM_ENDS_THEM], input=f"+{other.pid}\n".encode(), check=True, timeout=100
            )
            assert other.poll() is None
        finally:
            other.kill()


def test_the_guardian_ends_nodes_before_their_master() -> None:
    ended: list[list[int]] = []
    lines = ["*5\n", "+6 /a\n", "+7 /b\n", "-6\n"]
    guardian.watch(lines, 1.0, 1.0, "http://localhost:1", lambda pids, *_: ended.append(pids))
    assert ended == [[7], [5]]


@pytest.mark.parametrize(
    ("is_guarded", "own_master", "starts"), [(True, True, 0), (True, False, 1), (False, True, 1)]
)
def test_guardian_is_started_if_cleanup_is_needed(
    is_guarded: bool, own_master: bool, starts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If the system stops the processes, the guardian still unregisters nodes from a master that keeps running."""
    children = guard_children()
    monkeypatch.setattr(children, "is_guarded", is_guarded)
    monkeypatch.setattr(process, "guard_children", lambda: children)
    started: list[list[str]] = []

    def start(command: list[str], **options: object) -> subprocess.Popen[bytes]:
        started.append(command)
        return subprocess.Popen(
            [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, stderr=subprocess.DEVNULL
        )

    monkeypatch.setattr(process, "start_outside_of_job", start)
    done = [sys.executable, "-c", ""]
    master, node = (start_process(name, done, environ=os.environ) for name in ("master", "a"))
    node.node = NodeSpec("/a", "pkg", "a.py")
    guard = process.Guardian(Timeouts(), "http://localhost:1")
    for each in [master, node] if own_master else [node]:
        guard.add(each)
        guard.remove(each)
    guard.close()
    guard.close()
    assert len(started) == starts
    for each in (master, node):
        each.popen.wait()
