"""The master's journal on disk: what a master that was killed leaves to its successor.

One file for each user and port, ``ROS_HOME/master/journal-PORT``. A record is written, without fsync, before
the caller gets its answer: so a kill -9 loses nothing that was answered. A power cut may lose the last seconds,
and with them the nodes of this machine are gone too. The file is rewritten, and then synced, once it has grown
to several times what it holds. A master that ends as it should removes it: the next session starts empty.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from minirospy.wire.journal import HEAD, Recovered, parse_journal, serialize_record

__all__ = ["Journal", "JournalBusyError", "Left", "boot_id"]

_log = logging.getLogger(__name__)

_COMPACT_BYTES = 1024 * 1024
_COMPACT_FACTOR = 4
_RETRY_SECONDS = 30.0
_CREATE = os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)


class JournalBusyError(Exception):
    """Another master holds the journal; ``pid`` is its process, 0 where that is not known."""

    def __init__(self, path: Path, pid: int) -> None:
        super().__init__(path, pid)
        self.path = path
        self.pid = pid

    def __str__(self) -> str:
        return f"{self.path} is held by another master" + (f" (pid {self.pid})" if self.pid else "")


class Left(NamedTuple):
    """What a master that did not end as it should has left; ``age``: seconds since it last wrote."""

    recovered: Recovered
    age: float
    same_boot: bool


class Journal:
    """An open journal. ``snapshot`` gives the records that make up the present state, for a rewrite.

    :meth:`open` gives what was left, :meth:`rewrite` begins anew; then :meth:`append` never raises: where the
    disk fails, the master goes on without, says so, and tries again with a whole rewrite half a minute later.
    """

    def __init__(self, path: Path, snapshot: Callable[[], Iterable[list[Any]]]) -> None:
        self.path = path
        self._snapshot = snapshot
        self._file = -1
        self._lock = -1
        self._size = 0
        self._compact_at = 0
        self._failed_at = 0.0
        self.trouble = ""
        """Why nothing is written at present."""

    def open(self) -> Left | None:
        """Lock the journal; what was left in it, if anything. Raises OSError or JournalBusyError."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._lock = _locked(self.path.with_name(self.path.name + ".lock"), self.path)
        try:
            data = self.path.read_bytes()
            written = self.path.stat().st_mtime
        except FileNotFoundError:
            return None
        recovered = parse_journal(data)
        same_boot = recovered.records[:1] == [["boot", boot_id()]]
        left = Left(
            recovered._replace(records=recovered.records[1:]), max(0.0, time.time() - written), same_boot
        )
        if left.recovered.damage:
            with contextlib.suppress(OSError):
                self.path.with_name(self.path.name + ".damaged").write_bytes(data)
        return left

    @property
    def size(self) -> int:
        """Bytes in the file."""
        return self._size

    def rewrite(self) -> None:
        """Write the present state and nothing else. Raises OSError; the old file then still stands."""
        head = HEAD + serialize_record(["boot", boot_id()])
        data = head + b"".join(serialize_record(record) for record in self._snapshot())
        new = self.path.with_name(self.path.name + ".new")
        file = os.open(new, _CREATE | os.O_TRUNC, 0o600)
        try:
            _write_all(file, data)
            os.fsync(file)
            # Windows replaces no file that is open.
            self._close_file()
            if sys.platform == "win32":
                os.close(file)
                os.replace(new, self.path)
                file = os.open(self.path, _CREATE | os.O_APPEND)
            else:
                os.replace(new, self.path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.close(file)
            raise
        self._file = file
        self._size = len(data)
        self._compact_at = max(_COMPACT_BYTES, _COMPACT_FACTOR * len(data))
        self.trouble = ""

    def append(self, *record: Any) -> None:
        """Write one change. Never raises."""
        try:
            if self._file < 0:
                self._try_again()
                return
            data = serialize_record(list(record))
            _write_all(self._file, data)
            self._size += len(data)
            if self._size > self._compact_at:
                self.rewrite()
        except (OSError, ValueError, TypeError) as error:
            self._fail(error)

    def touch(self) -> None:
        """Say that this master is alive, for the age that :meth:`open` tells."""
        with contextlib.suppress(OSError):
            os.utime(self.path)

    def remove(self) -> None:
        """End as a master should: nothing is left to recover. Idempotent."""
        self._close_file()
        if self._lock >= 0:
            self.path.unlink(missing_ok=True)
        self.close()

    def close(self) -> None:
        """Let go of the file and leave it as it is. Idempotent."""
        self._close_file()
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def _close_file(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _fail(self, error: Exception) -> None:
        self.trouble = str(error)
        self._failed_at = time.monotonic()
        self._close_file()
        _log.error("the journal %s cannot be written, a crash would lose the graph: %s", self.path, error)

    def _try_again(self) -> None:
        if self._lock >= 0 and time.monotonic() - self._failed_at > _RETRY_SECONDS:
            self.rewrite()
            _log.warning("the journal %s is written again", self.path)


def _write_all(file: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(file, view) :]


def _locked(path: Path, journal: Path) -> int:
    """A lock that ends with this process, however it ends; in the file stands the pid."""
    file = os.open(path, _CREATE, 0o600)
    try:
        if sys.platform == "win32":
            import msvcrt

            # Beyond the pid, which others have to read.
            os.lseek(file, 64, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
            os.lseek(file, 0, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.lseek(file, 0, os.SEEK_SET)
        text = os.read(file, 20).strip()
        os.close(file)
        raise JournalBusyError(journal, int(text) if text.isdigit() else 0) from error
    os.ftruncate(file, 0)
    os.write(file, b"%d\n" % os.getpid())
    return file


def boot_id() -> str:
    """Something that is the same as long as this machine runs."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        import psutil

        # Elsewhere than on Linux the time of the start is counted back from now: a second more or less.
        return str(round(psutil.boot_time() / 60))
