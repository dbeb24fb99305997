"""A recording for the page: `rosbag record` as a child process, which completes the bag file if this process exits."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import minirospy
from minirospy.base.errors import UsageError
from minirospy.base.names import is_legal_name
from minirospy.ros.roslaunch.launcher.process import Guardian, Process, Timeouts, end_processes, start_process

__all__ = ["COMPRESSIONS", "Recording", "RecordingState"]

_TIMEOUTS = Timeouts(interrupt=120.0, terminate=10.0)
"""Timeouts in seconds for stopping a recording. After SIGINT, rosbag completes the file, possibly on a slow disk."""

TIMEOUTS_BEFORE_FILE = Timeouts(interrupt=5.0, terminate=10.0)
"""Timeouts in seconds for stopping while no file is open.

They are short, because a starting interpreter may lose a SIGINT that arrives in a callback of importlib.
"""

_MAX_LINES = 20
COMPRESSIONS = {".bag": {"none": [], "lz4": ["--lz4"], "bz2": ["--bz2"]},
                ".mcap": {"none": [], "lz4": ["--lz4"], "zstd": ["--zstd"]}}  # fmt: skip
"""Arguments for `rosbag record`, keyed by file type and compression."""


class RecordingState(NamedTuple):
    """The state of a recording: file name, topics, duration in seconds, and size in bytes.

    ``error`` describes why an ended recording failed; it is "" if it did not fail.
    """

    name: str
    topics: tuple[str, ...]
    seconds: float
    size: int
    is_ended: bool
    error: str


class Recording:
    """A process that runs `rosbag record`. The suffix of ``path``, .bag or .mcap, determines the format.

    Raise MinirospyError if the process cannot be started.
    """

    def __init__(self, path: Path, topics: Sequence[str], compression: str, master_uri: str) -> None:
        words = COMPRESSIONS[path.suffix].get(compression)
        if words is None:
            known = ", ".join(COMPRESSIONS[path.suffix])
            raise UsageError(
                f"{path.suffix} files have no compression '{compression[:40]}': there is {known}"
            )
        if not topics:
            raise UsageError("choose at least one topic to record")
        for topic in topics:
            if not topic.startswith("/") or not is_legal_name(topic):
                raise UsageError(f"'{topic[:200]}' is not the name of a topic")

        self._path = path
        self._paths = (path.with_name(f"{path.name}.active"), path)
        self._master_uri = master_uri
        self._topics = tuple(topics)
        self.lines: deque[str] = deque(maxlen=_MAX_LINES)
        self._started = time.monotonic()
        self._seconds: float | None = None
        self._guardian = Guardian(_TIMEOUTS, master_uri)
        try:
            self._process = self._start(words)
        except BaseException:
            self._guardian.close()
            raise
        self._guardian.add(self._process)
        self._reader = threading.Thread(target=self._read, name="recording-output", daemon=True)
        self._reader.start()

    def _start(self, words: Sequence[str]) -> Process:
        topics = [word for topic in self._topics for word in ("--topic", topic)]
        kind = ["--mcap"] if self._path.suffix == ".mcap" else []
        command = [
            sys.executable,
            "-m",
            "minirospy",
            "bag",
            "record",
            *kind,
            *words,
            "-O",
            str(self._path),
            *topics,
        ]

        return start_process(
            "rosbag record",
            command,
            environ={**os.environ, "PYTHONUNBUFFERED": "1", "ROS_MASTER_URI": self._master_uri},
            # `python -m` imports from the working folder first, so run it in a folder without the user's modules.
            folder=Path(minirospy.__file__).parents[2],
            stdout=subprocess.PIPE,
            log_errors=True,
        )

    def _read(self) -> None:
        """Read the output until the process exits; keep the last lines, and record the time of the exit."""
        stream = self._process.popen.stdout
        assert stream
        with stream:
            for line in stream:
                self.lines.append(line.decode("utf-8", "replace").rstrip())
        self._process.popen.wait()
        self._seconds = time.monotonic() - self._started

    def state(self) -> RecordingState:
        """Return the recording's current state."""
        # Query the exit status before the size, which is final only after the exit.
        status = self._process.exit_code
        size = 0
        for path in self._paths:
            try:
                size = max(size, path.stat().st_size)
            except OSError:
                continue
        seconds = self._seconds if self._seconds is not None else time.monotonic() - self._started
        error = ""
        # An interpreter that is stopped during its start-up may exit with status 0, too.
        if status is not None and self._process.is_ending and not size:
            error = "it was stopped before it had started: nothing was recorded"
        elif status:
            error = next(
                (line for line in reversed(tuple(self.lines)) if "ERROR" in line or "rror" in line),
                f"rosbag record ended with status {status}",
            )
        return RecordingState(self._path.name, self._topics, seconds, size, status is not None, error)

    async def stop(self) -> None:
        """Stop the recording, and wait until the file is complete. Idempotent."""
        await asyncio.get_running_loop().run_in_executor(None, self._stop)

    def _stop(self) -> None:
        has_file = any(path.exists() for path in self._paths)
        end_processes([self._process], _TIMEOUTS if has_file else TIMEOUTS_BEFORE_FILE, lambda _: None)
        self._reader.join()
        self._guardian.remove(self._process)
        self._guardian.close()
