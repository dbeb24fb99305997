"""Processes that roslaunch starts, each in its own process group. They are stopped in steps, and never left running."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TypedDict

from minirospy.base import private_files
from minirospy.base.child_lifetime import guard_children, start_outside_of_job
from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.launcher import guardian
from minirospy.ros.roslaunch.launcher.preload import ForkedProcess, Preload, Start
from minirospy.ros.roslaunch.launcher.spec import NodeSpec

__all__ = ["Guardian", "Process", "Timeouts", "end_processes", "start_process"]

_WINDOWS = sys.platform == "win32"


@dataclass(frozen=True)
class Timeouts:
    """Seconds to wait for a process to exit after SIGINT, and then after SIGTERM."""

    interrupt: float = 15.0
    terminate: float = 2.0


@dataclass(eq=False)
class Process:
    """A started process. ``node`` is None for the master; ``starts`` counts its starts."""

    name: str
    command: Sequence[str]
    popen: subprocess.Popen[bytes] | ForkedProcess
    node: NodeSpec | None = None
    log_files: str = ""
    stdout_file: Path | None = None
    starts: int = 1
    started: float = field(default_factory=time.monotonic)
    is_ending: bool = False  # whether the process has been told to exit, so that its exit is not reported

    # Whether the process will restart after its exit, because its file has changed.
    is_restarting: bool = False

    @property
    def pid(self) -> int:
        """Return the process id."""
        return self.popen.pid

    @property
    def exit_code(self) -> int | None:
        """Return the exit status as in subprocess, or None while the process is running."""
        return self.popen.poll()

    @property
    def is_running(self) -> bool:
        """Return whether the process is running."""
        return self.popen.poll() is None


class _Group(TypedDict, total=False):
    """The subprocess.Popen options that put a process into its own group."""

    creationflags: int
    start_new_session: bool


class Guardian:
    """Tracks the running processes and terminates them if roslaunch is killed.

    On Windows the system terminates them (`minirospy.base.child_lifetime`). There the guardian only unregisters nodes from a
    master that this launch did not start; otherwise its process is not started.
    """

    def __init__(self, timeouts: Timeouts, master_uri: str) -> None:
        self._children = guard_children()
        self._words = [str(guardian.__file__), str(timeouts.interrupt), str(timeouts.terminate), master_uri]
        self._words += [guardian.SYSTEM_ENDS_THEM] if self._children.is_guarded else []
        self._guard = threading.Lock()
        self._has_master = False
        self._popen = None if self._children.is_guarded else self._start()

    def add(self, process: Process) -> None:
        """Report a process's start to the guardian."""
        if process.node is None:
            self._has_master = True
        elif self._popen is None and not self._has_master:
            self._popen = self._start()
        self._write(f"+{process.pid} {process.node.name}\n" if process.node else f"*{process.pid}\n")

    def remove(self, process: Process) -> None:
        """Report a process's exit to the guardian."""
        self._write(f"-{process.pid}\n")

    def close(self) -> None:
        """Stop the guardian after all processes have exited. Idempotent."""
        if self._popen:
            with self._guard, contextlib.suppress(OSError):
                if self._popen.stdin:
                    self._popen.stdin.close()
            self._popen.wait()
        self._children.close()

    def _start(self) -> subprocess.Popen[bytes]:
        # On Windows, the guardian must outlive this process, whose job object ends the other children with it.
        return start_outside_of_job(
            [sys.executable, "-I", "-S", *self._words],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            **_own_group(),
        )

    def _write(self, line: str) -> None:
        if self._popen is None:
            return
        # If the guardian was killed, the launch continues without it.
        with self._guard, contextlib.suppress(OSError, ValueError):
            assert self._popen.stdin
            self._popen.stdin.write(line.encode())
            self._popen.stdin.flush()


def start_process(
    name: str,
    command: Sequence[str],
    *,
    environ: Mapping[str, str],
    folder: Path | None = None,
    stdout_file: Path | None = None,
    log_errors: bool = False,
    stdin: int | None = subprocess.DEVNULL,
    stdout: int | None = None,
    preload: Preload | None = None,
) -> Process:
    """Start a process. Its stdout (and stderr if ``log_errors``) goes to ``stdout_file``, or is inherited.

    ``stdin`` and ``stdout`` are as in subprocess. ``preload``: fork the process from a preloaded one if possible; its stdin is
    then empty unless ``stdin`` is None.

    Raise MinirospyError if the process cannot be started or the file cannot be written.
    """
    try:
        with _opened(stdout_file) as output:
            start = Start(tuple(command), environ, folder) if preload and folder else None
            forked = _forked(preload, start, stdin, output, log_errors) if preload and start else None
            popen = forked or subprocess.Popen(
                command,
                env=dict(environ),
                cwd=folder,
                stdin=stdin,
                stdout=output or stdout,
                stderr=subprocess.STDOUT if log_errors and (output or stdout) else None,
                **_own_group(),
            )
    except OSError as error:
        raise MinirospyError(f"[{name}] cannot be started: {error}") from error
    return Process(name, command, popen, stdout_file=stdout_file)


def end_processes(
    processes: Sequence[Process], timeouts: Timeouts, warn: Callable[[str], None]
) -> list[Process]:
    """Send SIGINT, then SIGTERM, then SIGKILL, until all processes have exited; return those that needed SIGKILL."""
    steps = (
        (_interrupt, timeouts.interrupt, ""),
        (_terminate, timeouts.terminate, "escalating to SIGTERM"),
        (_kill, timeouts.terminate, "escalating to SIGKILL"),
    )

    killed: list[Process] = []
    for step, seconds, words in steps:
        running = [process for process in processes if process.is_running]
        if step is _kill:
            killed = running
        notified = []
        for process in running:
            process.is_ending = True
            if words:
                warn(f"[{process.name}] {words}")
            # Do not wait for a process if send_signal() fails: it has exited or, on Windows, has no console.
            with contextlib.suppress(OSError):
                step(process.popen)
                notified.append(process)
        end = time.monotonic() + seconds
        for process in notified:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.popen.wait(max(0.0, end - time.monotonic()))

    if not _WINDOWS:
        for process in processes:
            # Also kill processes that a node has left running in its group.
            with contextlib.suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL)
    return killed


def _own_group() -> _Group:
    """Return options that shield a process from Ctrl-C, so that roslaunch can terminate nodes in the right order."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    return {"start_new_session": True}


def _forked(
    preload: Preload, start: Start, stdin: int | None, output: IO[str] | None, log_errors: bool
) -> ForkedProcess | None:
    """Fork a process from a preloaded one, or return None if it must be started normally."""
    stdout = output.fileno() if output else 1
    with open(os.devnull, "rb") as empty:
        fds = (0 if stdin is None else empty.fileno(), stdout, stdout if log_errors and output else 2)
        return preload.fork(start, fds)


@contextlib.contextmanager
def _opened(path: Path | None) -> Iterator[IO[str] | None]:
    if path is None:
        yield None
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = private_files.open_text(path, "a")
    except OSError as error:
        raise MinirospyError(f"cannot write the log file {path}: {error.strerror}") from error
    with file:
        yield file


def _interrupt(popen: subprocess.Popen[bytes] | ForkedProcess) -> None:
    if _WINDOWS:
        popen.send_signal(signal.CTRL_BREAK_EVENT)  # type: ignore[attr-defined,unused-ignore]
    else:
        os.killpg(popen.pid, signal.SIGINT)


def _terminate(popen: subprocess.Popen[bytes] | ForkedProcess) -> None:
    if _WINDOWS:
        popen.terminate()
    else:
        os.killpg(popen.pid, signal.SIGTERM)


def _kill(popen: subprocess.Popen[bytes] | ForkedProcess) -> None:
    """Kill a process and its descendants."""
    import psutil

    with contextlib.suppress(psutil.Error):
        for child in psutil.Process(popen.pid).children(recursive=True):
            child.kill()
    popen.kill()
