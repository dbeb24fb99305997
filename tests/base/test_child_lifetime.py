"""Tests when the job object that kills the children of a killed process is created and closed."""

from __future__ import annotations

import subprocess
import sys

import pytest

from minirospy.base.child_lifetime import ChildLifetime, ProcessJob, guard_children, start_outside_of_job

KILL_ON_JOB_CLOSE, BREAKAWAY_OK = 0x2000, 0x800


class Recorded:
    """A system whose calls are recorded; calls listed in ``failing`` fail."""

    def __init__(self, *failing: str) -> None:
        self.calls: list[str] = []
        self.failing = set(failing)

    def create(self) -> int:
        self._call("create")
        return 7

    def set_limits(self, job: int, flags: int) -> None:
        assert job == 7
        assert flags & BREAKAWAY_OK
        self._call("kill" if flags & KILL_ON_JOB_CLOSE else "spare")

    def add_this_process(self, job: int) -> None:
        assert job == 7
        self._call("add")

    def _call(self, name: str) -> None:
        self.calls.append(name)
        if name in self.failing:
            raise OSError(name)


def test_children_end_with_the_process_until_the_last_guard_is_closed() -> None:
    system = Recorded()
    job = ProcessJob(system)
    with ChildLifetime(job) as outer:
        assert outer.is_guarded
        inner = ChildLifetime(job)
        assert system.calls == ["create", "spare", "add", "kill"]
        inner.close()
        inner.close()
        assert not inner.is_guarded
        assert system.calls[-1] == "kill"
    assert system.calls == ["create", "spare", "add", "kill", "spare"]

    # A process is assigned to its job only once.
    ChildLifetime(job).close()
    assert system.calls[5:] == ["kill", "spare"]


@pytest.mark.parametrize("failing", ["create", "spare", "add", "kill"])
def test_a_system_that_refuses_leaves_the_children_unguarded(failing: str) -> None:
    system = Recorded(failing)
    job = ProcessJob(system)
    guard = ChildLifetime(job)
    assert not guard.is_guarded
    guard.close()
    assert system.calls[-1] == failing

    system.failing.clear()
    with ChildLifetime(job) as again:
        assert again.is_guarded
    assert system.calls[-2:] == ["kill", "spare"]


def test_only_windows_guards_children() -> None:
    with guard_children() as guard:
        assert guard.is_guarded == (sys.platform == "win32")


def test_a_process_outside_of_the_job_takes_the_options_of_popen() -> None:
    with guard_children():
        process = start_outside_of_job([sys.executable, "-c", "print(4)"], stdout=subprocess.PIPE)
        assert process.communicate()[0].strip() == b"4"
