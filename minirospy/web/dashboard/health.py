"""Data of the start view, besides the graph: the findings of `minirospy doctor`, running boards, and the last log lines.

The doctor runs in a child process, because its checks block and must not delay the page's data.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from pathlib import Path

from minirospy.base.environment import run_folder
from minirospy.base.errors import BoardError, MinirospyError
from minirospy.board.directory import BoardDirectory
from minirospy.ros.roslaunch.launcher.process import Process, Timeouts, end_processes, start_process

__all__ = ["Examiner", "last_log_lines", "running_boards"]

_KEPT_SECONDS = 5.0  # seconds for which findings are reused, so that several pages share them
_TIMEOUTS = Timeouts(interrupt=3.0, terminate=1.0)  # seconds; after SIGINT, the doctor unregisters its node
_TAIL_BYTES = 64 * 1024  # number of bytes shown from the end of rosout.log: about 500 lines


class Examiner:
    """Runs `minirospy doctor` for the pages, never more than once at a time. Thread-safe."""

    def __init__(self, master_uri: str) -> None:
        self._master_uri = master_uri
        self._running = threading.Lock()
        self._process: Process | None = None
        self._is_closed = False
        self._found: list[Mapping[str, str]] = []
        self._finished = -_KEPT_SECONDS

    def findings(self) -> list[Mapping[str, str]]:
        """Return the doctor's findings: check, status, text and advice of each. Raise MinirospyError if it fails."""
        with self._running:
            if time.monotonic() - self._finished >= _KEPT_SECONDS:
                self._found = self._examine()
                self._finished = time.monotonic()
            return self._found

    def close(self) -> None:
        """Stop the running examination, if there is one. Idempotent. Blocks for at most a few seconds."""
        self._is_closed = True
        process = self._process
        if process:
            end_processes([process], _TIMEOUTS, lambda _: None)

    def _examine(self) -> list[Mapping[str, str]]:
        # Run in an empty folder, because `python -m` first searches the working folder for modules.
        with tempfile.TemporaryDirectory(prefix="minirospy-doctor-", ignore_cleanup_errors=True) as folder:
            process = start_process(
                "minirospy doctor",
                [sys.executable, "-m", "minirospy", "doctor", "--json"],
                environ={**os.environ, "ROS_MASTER_URI": self._master_uri},
                folder=Path(folder),
                stdout=subprocess.PIPE,
            )
            self._process = process
            try:
                if self._is_closed:
                    end_processes([process], _TIMEOUTS, lambda _: None)
                assert isinstance(process.popen, subprocess.Popen)  # only roslaunch creates ForkedProcesses
                output, _ = process.popen.communicate()
            finally:
                self._process = None
        status = process.popen.returncode
        if status not in (0, 1):
            raise MinirospyError(f"minirospy doctor ended with status {status}")
        return [json.loads(line) for line in output.decode("utf-8", "replace").splitlines()]


def running_boards() -> list[str]:
    """Return the names of this machine's boards that are in use."""
    try:
        own = BoardDirectory.find()
        found = [BoardDirectory(name, own.folder) for name in own.names()]
        return [each.name for each in found if each.socket_path.exists() or each.address_path.exists()]
    except (BoardError, OSError):
        return []


def last_log_lines(log_dir: Path, run_id: object) -> str:
    """Return the last lines of a run's rosout.log, or "" if the file is not on this machine."""
    folder = run_folder(log_dir, run_id)
    if folder is None:
        return ""
    try:
        with (folder / "rosout.log").open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - _TAIL_BYTES))
            data = file.read(_TAIL_BYTES)
    except OSError:
        return ""
    if size > _TAIL_BYTES:
        data = data.partition(b"\n")[2]
    return data.decode("utf-8", "replace")
