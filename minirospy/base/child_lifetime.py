"""Terminate child processes with this process, even if it is killed.

On Windows the system does this when it closes a job object. On other systems a launcher's guardian process terminates
them (`ros/roslaunch/launcher/guardian.py`), and this module has no effect. Source:
https://learn.microsoft.com/en-us/windows/win32/procthread/job-objects
"""

from __future__ import annotations

import functools
import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import subprocess

__all__ = ["ChildLifetime", "JobSystem", "ProcessJob", "guard_children", "start_outside_of_job"]

_KILL_ON_JOB_CLOSE = 0x2000
_BREAKAWAY_OK = 0x0800
_EXTENDED_LIMIT_INFORMATION = 9
_CREATE_BREAKAWAY_FROM_JOB = 0x01000000


class JobSystem(Protocol):
    """The system calls for job objects. Each method raises OSError if the call fails."""

    def create(self) -> int:
        """Create a Windows job object; return its handle."""

    def set_limits(self, job: int, flags: int) -> None:
        """Set the limits of the job ``job``."""

    def add_this_process(self, job: int) -> None:
        """Add this process to a job. Processes that it starts afterwards belong to the job, too."""


class ProcessJob:
    """The job that contains this process and its children. All guards share one job, because a process cannot leave its job."""

    def __init__(self, system: JobSystem) -> None:
        self._system = system
        self._lock = threading.Lock()
        self._job: int | None = None
        self._guards = 0

    def guard(self) -> bool:
        """Make the system terminate the children when this process exits. Return whether the system supports that."""
        with self._lock:
            try:
                if self._job is None:
                    # The job's handle is never closed here. The system closes it when this process exits, whatever the reason.
                    job = self._system.create()
                    self._system.set_limits(job, _BREAKAWAY_OK)
                    self._system.add_this_process(job)
                    self._job = job
                if self._guards == 0:
                    self._system.set_limits(self._job, _BREAKAWAY_OK | _KILL_ON_JOB_CLOSE)
            except OSError:
                return False
            self._guards += 1
            return True

    def release(self) -> None:
        """Undo one call of :meth:`guard`. Once all calls are undone, children may outlive this process again."""
        with self._lock:
            self._guards -= 1
            if self._guards == 0 and self._job is not None:
                try:
                    self._system.set_limits(self._job, _BREAKAWAY_OK)
                except OSError:
                    return


class ChildLifetime:
    """A context manager; until its exit or :meth:`close`, child processes end with this process if ``is_guarded`` is true."""

    def __init__(self, job: ProcessJob | None) -> None:
        self._job = job if job is not None and job.guard() else None
        self.is_guarded = self._job is not None

    def close(self) -> None:
        """Let children outlive this process. Idempotent."""
        job, self._job = self._job, None
        self.is_guarded = False
        if job is not None:
            job.release()

    def __enter__(self) -> ChildLifetime:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def guard_children() -> ChildLifetime:
    """On Windows, make child processes started from now on terminate when this process does.

    Close the returned object to undo this.
    """
    return ChildLifetime(_process_job())


def start_outside_of_job(
    command: Sequence[str],
    *,
    creationflags: int = 0,
    **options: Any,
) -> subprocess.Popen[bytes]:
    """Start a process that may outlive this one, even if this process's children are guarded.

    ``options`` are those of subprocess.Popen. Raise OSError if the process cannot be started.
    """
    import subprocess

    if sys.platform == "win32":
        try:
            return subprocess.Popen(
                command, creationflags=creationflags | _CREATE_BREAKAWAY_FROM_JOB, **options
            )
        except PermissionError:
            # Start it inside the job: an IDE's or a service's job that contains this process does not let processes leave.
            pass
    return subprocess.Popen(command, creationflags=creationflags, **options)


@functools.cache
def _process_job() -> ProcessJob | None:
    if sys.platform == "win32":
        return ProcessJob(_Windows())
    return None


if sys.platform == "win32":
    import ctypes
    from ctypes import wintypes

    class _BasicLimits(ctypes.Structure):
        _fields_ = [
            ("PerProcessUserTimeLimit", wintypes.LARGE_INTEGER),
            ("PerJobUserTimeLimit", wintypes.LARGE_INTEGER),
            ("LimitFlags", wintypes.DWORD),
            ("MinimumWorkingSetSize", ctypes.c_size_t),
            ("MaximumWorkingSetSize", ctypes.c_size_t),
            ("ActiveProcessLimit", wintypes.DWORD),
            ("Affinity", ctypes.c_size_t),
            ("PriorityClass", wintypes.DWORD),
            ("SchedulingClass", wintypes.DWORD),
        ]

    class _ExtendedLimits(ctypes.Structure):
        _fields_ = [
            ("BasicLimitInformation", _BasicLimits),
            ("IoInfo", ctypes.c_ulonglong * 6),
            ("MemoryLimits", ctypes.c_size_t * 4),
        ]

    class _Windows:
        """The implementation of JobSystem for Windows, which uses kernel32."""

        def __init__(self) -> None:
            self._kernel = ctypes.WinDLL("kernel32", use_last_error=True)
            self._kernel.CreateJobObjectW.restype = wintypes.HANDLE
            self._kernel.CreateJobObjectW.argtypes = [wintypes.LPVOID, wintypes.LPCWSTR]
            self._kernel.GetCurrentProcess.restype = wintypes.HANDLE
            self._kernel.AssignProcessToJobObject.argtypes = [wintypes.HANDLE, wintypes.HANDLE]
            self._kernel.SetInformationJobObject.argtypes = [
                wintypes.HANDLE,
                ctypes.c_int,
                wintypes.LPVOID,
                wintypes.DWORD,
            ]

        def create(self) -> int:
            job: int | None = self._kernel.CreateJobObjectW(None, None)
            self._check(job)
            assert job is not None
            return job

        def set_limits(self, job: int, flags: int) -> None:
            limits = _ExtendedLimits()
            limits.BasicLimitInformation.LimitFlags = flags
            size = ctypes.sizeof(limits)
            self._check(
                self._kernel.SetInformationJobObject(
                    job, _EXTENDED_LIMIT_INFORMATION, ctypes.byref(limits), size
                )
            )

        def add_this_process(self, job: int) -> None:
            self._check(self._kernel.AssignProcessToJobObject(job, self._kernel.GetCurrentProcess()))

        @staticmethod
        def _check(result: int | None) -> None:
            if not result:
                raise ctypes.WinError(ctypes.get_last_error())
