"""Forks Python nodes from processes that have already imported rospy. These processes run ``preloaded.py``.

Importing rospy and asyncio takes most of a small node's start-up time and memory, and forked nodes share the imported modules.
Only Linux can change the command line of a forked process, and macOS libraries do not support fork without exec, so nodes start
as usual on other systems. They also start as usual if a forked process would behave differently from a started one.
"""

from __future__ import annotations

import contextlib
import marshal
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

__all__ = ["MIN_NODES", "ForkedProcess", "Preload", "Start"]

MIN_NODES = 3  # minimum number of similar nodes for which preloading pays off
REPLY_SECONDS = 30.0  # seconds to wait for a reply from a preloaded process on a busy machine
POLL_SECONDS = 0.01  # seconds between checks whether a process has exited

_PR_SET_CHILD_SUBREAPER, _PR_GET_CHILD_SUBREAPER = 36, 37
_FORKING = threading.Lock()
"""Held during a fork, which temporarily makes the whole process a subreaper."""

_MIRRORED = frozenset(
    ("PYTHONPATH", "PYTHONUNBUFFERED", "PYTHONDONTWRITEBYTECODE", "PYTHONIOENCODING", "PYTHONUTF8")
)
"""Python's environment variables that have the same effect in a forked process. If any other one is set, nodes start as usual."""


@dataclass(frozen=True)
class Start:
    """The inputs for starting a process: its command line, environment and working folder."""

    command: tuple[str, ...]
    environ: Mapping[str, str]
    folder: Path

    @property
    def is_plain_python(self) -> bool:
        """Return whether the program is Python without interpreter options, a debugger or a profiler."""
        return (
            len(self.command) > 1
            and self.command[0] == sys.executable
            and not self.command[1].startswith("-")
            and os.path.isabs(self.command[1])
            and os.access(self.command[1], os.R_OK)
            and not any(
                name.startswith("COVERAGE_") or (name.startswith("PYTHON") and name not in _MIRRORED)
                for name in self.environ
            )
        )

    @property
    def kind(self) -> _Kind:
        """Return the properties that processes forked from the same preloaded process must share."""
        shared = frozenset((name, value) for name, value in self.environ.items() if name != "ROS_NAMESPACE")
        return _Kind(shared, self.folder)


@dataclass(frozen=True)
class _Kind:
    """The properties that processes must share: the environment without ROS_NAMESPACE, and the working folder."""

    environ: frozenset[tuple[str, str]]
    folder: Path


class ForkedProcess:
    """A child of this process, forked by a preloaded process. Has the interface of subprocess.Popen. Thread-safe."""

    # None, as in a Popen without pipes: the child's standard streams are files.
    stdin: IO[bytes] | None = None
    stdout: IO[bytes] | None = None
    stderr: IO[bytes] | None = None

    def __init__(self, args: Sequence[str], pid: int) -> None:
        self.args = args
        self.pid = pid
        self.returncode: int | None = None
        self._start_time = _start_time(pid)
        self._lock = threading.Lock()

    def poll(self) -> int | None:
        """Return the exit status as in subprocess, or None if the process is still running."""
        with self._lock:
            if self.returncode is None:
                try:
                    pid, status = os.waitpid(self.pid, os.WNOHANG)
                except ChildProcessError:
                    # If SIGCHLD is ignored or another part of the program has collected the exit status, return 0, as subprocess
                    # does. Otherwise, the process is still running, with another parent.
                    if self._start_time is None or _start_time(self.pid) != self._start_time:
                        self.returncode = 0
                else:
                    if pid:
                        self.returncode = os.waitstatus_to_exitcode(status)
            return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait until the process has exited and return its exit status.

        Raise subprocess.TimeoutExpired after ``timeout`` seconds.
        """
        end = None if timeout is None else time.monotonic() + timeout
        while (status := self.poll()) is None:
            if end is not None and time.monotonic() >= end:
                assert timeout is not None
                raise subprocess.TimeoutExpired(list(self.args), timeout)
            time.sleep(POLL_SECONDS)
        return status

    def send_signal(self, number: int) -> None:
        """Send a signal, unless the process has exited."""
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def terminate(self) -> None:
        """Send SIGTERM."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL."""
        self.send_signal(signal.SIGKILL)


def _start_time(pid: int) -> bytes | None:
    """Return a process's start time, which distinguishes it from a later process with the same id; None if it has exited."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return None
    # proc(5): field 3 is the state, field 22 the start time. A zombie has exited.
    return None if fields[0] in b"ZX" else fields[19]


class Preload:
    """A launch's preloaded processes: one for each kind of node that occurs often enough."""

    def __init__(self) -> None:
        self._parents: dict[_Kind, _Parent] = {}

    def prepare(self, starts: Sequence[Start]) -> None:
        """Start the preloaded processes that will fork ``starts``. They import rospy while the launch continues.

        Do nothing if the environment variable MINIROSPY_PRELOAD is 0.
        """
        if sys.platform != "linux" or os.environ.get("MINIROSPY_PRELOAD") == "0":
            return
        similar: dict[_Kind, list[Start]] = {}
        for start in starts:
            if start.is_plain_python:
                similar.setdefault(start.kind, []).append(start)
        for kind, members in similar.items():
            if len(members) >= MIN_NODES:
                # Python without libffi has no ctypes.
                with contextlib.suppress(OSError, ImportError):
                    self._parents[kind] = _Parent(members[0])

    def fork(self, start: Start, fds: tuple[int, int, int]) -> ForkedProcess | None:
        """Fork a process with the standard streams ``fds``, or return None if it must be started normally."""
        parent = self._parents.get(start.kind) if self._parents and start.is_plain_python else None
        if parent is None:
            return None
        try:
            return parent.fork(start, fds)
        except OSError:
            self._parents.pop(start.kind).close()
            return None

    def close(self) -> None:
        """End the preloaded processes. Idempotent."""
        while self._parents:
            self._parents.popitem()[1].close()


class _Parent:
    """A preloaded process and the socket to it."""

    def __init__(self, start: Start) -> None:
        # Imported here, because it imports ctypes, which few launches need.
        from minirospy.ros.roslaunch.launcher import preloaded

        self._protocol = preloaded
        self._is_ready = False
        self._socket, theirs = socket.socketpair()
        self._socket.settimeout(REPLY_SECONDS)
        environ = {name: value for name, value in start.environ.items() if name != "ROS_NAMESPACE"}
        try:
            self._popen = subprocess.Popen(
                [sys.executable, preloaded.__file__, str(theirs.fileno())],
                env=environ,
                cwd=start.folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )
        except OSError:
            self._socket.close()
            raise
        finally:
            theirs.close()

    def fork(self, start: Start, fds: tuple[int, int, int]) -> ForkedProcess | None:
        """Fork a process, or return None if its program must be started normally. Raise OSError if there is no reply."""
        if not self._is_ready:
            if self._socket.recv(len(self._protocol.READY)) != self._protocol.READY:
                raise ConnectionError("the process exited, or cannot fork nodes")
            self._is_ready = True
        for fd in fds:
            os.fstat(fd)

        body = marshal.dumps((list(start.command), dict(start.environ)))
        gate, opener = os.pipe()
        with open(opener, "wb", buffering=0) as starter:
            try:
                with _subreaper():
                    head = len(body).to_bytes(self._protocol.LENGTH_SIZE, "little")
                    socket.send_fds(self._socket, [head], [*fds, gate])
                    self._socket.sendall(body)
                    answer = self._socket.recv(64)
            finally:
                os.close(gate)
            if answer == self._protocol.REFUSED:
                return None
            if not answer:
                raise ConnectionError("the process exited")
            process = ForkedProcess(start.command, int(answer))
            # If this process exits before this write, the node exits without running its program.
            starter.write(b"1")
        return process

    def close(self) -> None:
        """End the process."""
        self._socket.close()
        try:
            self._popen.wait(1)
        except subprocess.TimeoutExpired:
            self._popen.kill()
            self._popen.wait()


@contextlib.contextmanager
def _subreaper() -> Iterator[None]:
    """Make this process the parent of orphaned descendants. Raise OSError if the kernel refuses."""
    import ctypes

    library = ctypes.CDLL(None, use_errno=True)
    library.prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]

    def call(option: int, value: int) -> None:
        if library.prctl(option, value, 0, 0, 0):
            raise OSError(ctypes.get_errno(), "prctl")

    with _FORKING:
        # Restore the setting afterwards: the program may use it for other processes.
        before = ctypes.c_int()
        call(_PR_GET_CHILD_SUBREAPER, ctypes.addressof(before))
        call(_PR_SET_CHILD_SUBREAPER, 1)
        try:
            yield
        finally:
            call(_PR_SET_CHILD_SUBREAPER, before.value)
