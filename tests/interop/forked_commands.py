"""Run commands of real ROS in forks of a process that has imported the command's module: imports take most of their time.

The command's code, arguments, environment, folder and streams are those of a separate start; only the output of an import
and the outer lines of a traceback differ. The Python of real ROS, 3.9 or newer, runs this file as the server of one
command: ``forked_commands.py /usr/bin/rostopic rostopic SOCKET``.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import runpy
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

REAL_PYTHON = "/usr/bin/python3"
# The module that each command imports.
MODULES = {
    "rosmsg": "rosmsg",
    "rosmsg-proto": "rosmsg",
    "rosnode": "rosnode",
    "rosparam": "rosparam",
    "rosservice": "rosservice",
    "rossrv": "rosmsg",
    "rostopic": "rostopic",
}
MAX_REQUEST = 1 << 17  # bytes, for a command line, its folder and its environment


def can_fork(words: list[str]) -> bool:
    """Return whether a fork behaves as a separate start does: rospy reads remappings when it is imported."""
    return words[0] in MODULES and not any(":=" in word for word in words)


class Server:
    """A process that forks each time a command is started. Any thread may start one. Use it with ``with``."""

    def __init__(self, command: Path) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            number = theirs.fileno()
            self._program = subprocess.Popen(
                [REAL_PYTHON, __file__, str(command), MODULES[command.name], str(number)],
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[number],
            )

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._program.wait()

    def start(self, words: list[str], environment: dict[str, str], folder: Path) -> ForkedCommand:
        """Start the command with the arguments ``words``."""
        request = json.dumps([words, environment, str(folder)]).encode()
        assert len(request) < MAX_REQUEST
        ours, theirs = zip(*(os.pipe() for _ in range(3)), strict=True)
        given, to_stdin = os.pipe()
        try:
            socket.send_fds(self._socket, [request], [given, *theirs])
        finally:
            for each in (given, *theirs):
                os.close(each)
        return ForkedCommand(to_stdin, *ours)


class ForkedCommand:
    """A started command, with the methods of subprocess.Popen that the tests use."""

    def __init__(self, stdin: int, stdout: int, stderr: int, state: int) -> None:
        self._stdin, self.stdout, self.stderr = os.fdopen(stdin, "w"), os.fdopen(stdout), os.fdopen(stderr)
        self._state = os.fdopen(state)
        self._readers: list[threading.Thread] = []
        self._texts = ["", ""]
        line = self._state.readline()
        if not line:
            raise RuntimeError("the server of this command has exited: its error is on stderr")
        self.pid = int(line)
        self.returncode = 0

    def send_signal(self, number: int) -> None:
        """Send a signal, unless the command has exited."""
        try:
            os.kill(self.pid, number)
        except ProcessLookupError:
            pass

    def communicate(self, given: str = "", timeout: float | None = None) -> tuple[str, str]:
        """Write to stdin, and return the output when the command has exited.

        Raise subprocess.TimeoutExpired if it takes longer; it may then be called again.
        """
        if not self._readers:
            self._readers = [
                threading.Thread(target=self._read, args=(index,), daemon=True) for index in (0, 1)
            ]
            for reader in self._readers:
                reader.start()
            try:
                with self._stdin:
                    self._stdin.write(given)
            except BrokenPipeError:
                pass
        deadline = None if timeout is None else time.monotonic() + timeout
        for reader in self._readers:
            reader.join(None if deadline is None else max(deadline - time.monotonic(), 0.0))
            if reader.is_alive():
                raise subprocess.TimeoutExpired("a forked command", timeout or 0.0)
        with self._state:
            self.returncode = int(self._state.readline())
        return self._texts[0], self._texts[1]

    def _read(self, index: int) -> None:
        with (self.stdout, self.stderr)[index] as stream:
            self._texts[index] = stream.read()


def serve(script: str, module: str, number: str) -> None:
    """Fork for each request. Return in the command's process; its parent waits for it and reports its exit status."""
    sys.argv[:] = [script]
    sys.path[0] = os.path.dirname(script)
    importlib.import_module(module)
    # A fork then copies fewer pages.
    gc.collect()
    gc.freeze()
    with socket.socket(fileno=int(number)) as requests:
        while True:
            request, streams, _, _ = socket.recv_fds(requests, MAX_REQUEST, 4)
            if not request:
                os._exit(0)
            if not os.fork():
                break
            for each in streams:
                os.close(each)
            _collect_children()

    *standard, state = streams
    if child := os.fork():
        os.write(state, b"%d\n" % child)
        for each in standard:
            os.close(each)
        _, ended = os.waitpid(child, 0)
        os.write(state, b"%d\n" % os.waitstatus_to_exitcode(ended))
        os._exit(0)
    os.close(state)
    for descriptor, each in enumerate(standard):
        os.dup2(each, descriptor)
        os.close(each)
    words, environment, folder = json.loads(request)
    sys.argv[1:] = words
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)


def _collect_children() -> None:
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        pass


if __name__ == "__main__":
    serve(*sys.argv[1:])
    runpy.run_path(sys.argv[0], run_name="__main__")
