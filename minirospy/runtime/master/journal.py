"""The master's journal on disk. If this master is killed, the next one restores the state from it.

There is one file per user and port, ``ROS_HOME/master/journal-PORT``. Each record is written, without fsync, before
the caller gets its response, so kill -9 loses nothing that was confirmed. A power cut may lose the last seconds, but it
also terminates the nodes on this machine. The file is rewritten, and then synced, once it has grown to several times the
size of the state. A master that shuts down cleanly removes the file, so that the next session starts empty.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from minirospy.base import private_files
from minirospy.base.steps import PAUSE, Steps, finish, is_small
from minirospy.core.wire.journal import HEAD, Recovered, pack_in_steps, parse_journal, serialize_record

__all__ = ["RETRY_SECONDS", "Journal", "JournalBusyError", "Left", "boot_id"]

_log = logging.getLogger(__name__)

COMPACT_BYTES = 1024 * 1024
COMPACT_FACTOR = 4
_STEP_RECORDS = 200

RETRY_SECONDS = 30.0  # seconds before writing the journal again after a failure

_BUSY = {errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK}
"""The errors raised by locking a file that another process has locked; Windows raises the last two."""


class JournalBusyError(Exception):
    """Another master has locked the journal; ``pid`` is its process id, or 0 if unknown."""

    def __init__(self, path: Path, pid: int) -> None:
        super().__init__(path, pid)
        self.path = path
        self.pid = pid

    def __str__(self) -> str:
        return f"{self.path} is held by another master" + (f" (pid {self.pid})" if self.pid else "")


class Left(NamedTuple):
    """The state recovered from a killed master's journal. ``age``: seconds since the journal was last written or touched.

    ``copy`` is the path of the copy of a damaged journal, or None if there is no copy.
    """

    recovered: Recovered
    age: float
    same_boot: bool
    copy: Path | None = None


class Journal:
    """An open journal. ``snapshot`` returns the records of the current state, for a rewrite.

    Call :meth:`lock`, :meth:`read`, :meth:`start`, then :meth:`append`, in this order. If the disk fails at any step,
    the master runs without a journal: ``trouble`` is the reason, and a complete rewrite is retried every half minute.
    """

    def __init__(
        self,
        path: Path,
        snapshot: Callable[[], Iterable[list[object]]],
        clock: Callable[[], float] = time.monotonic,
        start_steps: Callable[[Steps[None]], object] = finish,
    ) -> None:
        """Create the journal. ``start_steps`` runs long work, such as a large rewrite, immediately or in steps."""
        self.path = path
        self._start_steps = start_steps
        self._snapshot = snapshot
        self._clock = clock

        self._file: int | None = None
        self._lock: int | None = None
        self._size = 0
        self._compact_at: int
        self._failed_at: float
        self.trouble = ""  # the reason why the journal is not being written, or ""

        # The numbers of the large values that are being stored, and the last number assigned.
        self._stored: set[int] = set()
        self._number = 0
        # During an incremental rewrite: the records appended since it started, and the new file's descriptor.
        self._since: list[bytes] | None = None
        self._second: int | None = None
        # Number of finished or abandoned incremental rewrites. If it changes during a rewrite, that rewrite was abandoned.
        self._rewrites = 0

    @property
    def size(self) -> int:
        """Return the number of bytes in the file."""
        return self._size

    def lock(self) -> None:
        """Lock the journal, so that only this process writes it.

        Raise JournalBusyError if another master has locked it, OSError if it cannot be locked.
        """
        if self._lock is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._lock = _locked(self.path.with_name(self.path.name + ".lock"), self.path)

    def read(self) -> Left | None:
        """Return the state left by a killed master, or None if there is none."""
        try:
            data, written = private_files.read_file(self.path)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            damage = f"it cannot be read: {_reason(error)}"
            return Left(Recovered([], 0, damage), 0.0, same_boot=True, copy=self._set_aside())
        recovered = parse_journal(data)
        same_boot = recovered.records[:1] == [["boot", boot_id()]]
        copy = self._keep_copy(data) if recovered.damage else None
        recovered = recovered._replace(records=recovered.records[1:])
        return Left(recovered, max(0.0, time.time() - written), same_boot, copy)

    def discard(self) -> None:
        """Discard the state left by a killed master."""
        with contextlib.suppress(OSError):
            self.path.unlink()

    def start(self) -> None:
        """Write the current state; after this, :meth:`append` writes each change. Never raises: see ``trouble``."""
        try:
            self.lock()
            self.rewrite()
        except (OSError, ValueError, TypeError, JournalBusyError) as error:
            self._fail(error)

    def rewrite(self) -> None:
        """Replace the file's contents with the current state. Raise OSError if the disk fails; the old file then remains."""
        head = HEAD + serialize_record(["boot", boot_id()])
        data = head + b"".join(serialize_record(record) for record in self._snapshot())
        self._abandon()
        new = self._new_path
        file = private_files.create_file(new)
        try:
            _write_all(file, data)
            os.fsync(file)
            file = self._put_in_place(file)
        except BaseException:
            # On Windows, the file may already be closed.
            with contextlib.suppress(OSError):
                os.close(file)
            # Remove the incomplete new file, because appending to the old file may need the space on a full disk.
            with contextlib.suppress(OSError):
                new.unlink()
            raise

        self._switch_to(file, len(data))

    def append(self, *record: object) -> None:
        """Write one change. Never raises."""
        if self._file is None:
            self.retry()
            return
        try:
            if record[0] == "put":
                if record[2] not in self._stored:
                    # The disk failed in the meantime, and the parts of the value were lost with the old file.
                    # Write everything again.
                    self.rewrite()
                    return
                self._stored.discard(record[2])
            self._write(self._file, serialize_record(list(record)))
            if self._size > self._compact_at and not self._stored and not self._is_rewriting:
                self._since = []
                self._start_steps(self._rewrite_in_steps(self._rewrites))
        except (OSError, ValueError, TypeError) as error:
            self._fail(error)
            self._log_trouble()

    def store(self, value: object) -> Steps[int]:
        """Write a large value in parts; return the number by which a "put" record refers to the value. Never raises."""
        while self._is_rewriting:
            yield PAUSE

        self._number += 1
        number = self._number
        self._stored.add(number)
        is_whole = False

        try:
            for piece in pack_in_steps(value):
                if self._file is not None and number in self._stored:
                    self._write(self._file, serialize_record(["part", number, piece]))
                yield None
            is_whole = True
        except (OSError, ValueError, TypeError) as error:
            self._fail(error)
            self._log_trouble()
        finally:
            if not is_whole:
                self._stored.discard(number)
        return number

    @property
    def _is_rewriting(self) -> bool:
        return self._since is not None

    def _write(self, file: int, data: bytes) -> None:
        _write_all(file, data)
        self._size += len(data)
        if self._since is not None:
            self._since.append(data)

    def _rewrite_in_steps(self, number: int) -> Steps[None]:
        """Like :meth:`rewrite`, but in steps, while :meth:`append` continues to write."""
        size = 0
        try:
            if number != self._rewrites:
                return
            records = self._snapshot()
            self._second = private_files.create_file(self._new_path)
            for piece in _pieces_of(records):
                _write_all(self._second, piece)
                size += len(piece)
                yield None
                if number != self._rewrites:
                    return
            size += self._write_since(self._second)

            # Sync in a thread, so that a slow sync does not block the loop. A write to this file would wait for the sync.
            syncing = _Sync(self._second)
            syncing.start()
            while syncing.is_alive():
                yield PAUSE
                if number != self._rewrites:
                    return
            if syncing.error:
                raise syncing.error
            size += self._write_since(self._second)
            file, self._second, self._since = self._put_in_place(self._second), None, None
            self._switch_to(file, size)
        except (OSError, ValueError, TypeError) as error:
            _log.warning("the journal %s could not be rewritten, it keeps growing: %s", self.path, error)
            self._compact_at = 2 * self._size
            if self._file is None:
                # On Windows, _put_in_place() closes the old file before it fails, so no file is open.
                self._fail(error)
        finally:
            if number == self._rewrites:
                self._abandon()

    def _write_since(self, file: int) -> int:
        """Write to the new file the records appended since the start or the last call; return the number of bytes written.

        Raise OSError if the disk fails.
        """
        data = b"".join(self._since or ())
        _write_all(file, data)
        self._since = []
        return len(data)

    def _put_in_place(self, file: int) -> int:
        """Rename the new, synced file to the journal's name. Return its open descriptor. Raise OSError if renaming fails."""
        if sys.platform == "win32":
            # Close both files first: Windows can neither replace an open file nor rename one.
            self._close_file()
            os.close(file)
            private_files.replace_file(self._new_path, self.path)
            return private_files.open_file(self.path, os.O_RDWR | os.O_APPEND)
        private_files.replace_file(self._new_path, self.path)
        self._close_file()
        return file

    def _switch_to(self, file: int, size: int) -> None:
        self._file = file
        self._size = size
        self._compact_at = max(COMPACT_BYTES, COMPACT_FACTOR * size)
        self._stored.clear()
        self.trouble = ""

    def _abandon(self) -> None:
        """Abandon an incremental rewrite. Idempotent."""
        self._rewrites += 1
        self._since = None
        if self._second is not None:
            with contextlib.suppress(OSError):
                os.close(self._second)
            self._second = None
            with contextlib.suppress(OSError):
                self._new_path.unlink()

    def retry(self) -> None:
        """Write the current state if the last attempt failed at least half a minute ago. Never raises."""
        if self.trouble and self._clock() - self._failed_at >= RETRY_SECONDS:
            self.start()
            if not self.trouble:
                _log.warning("the journal %s is written again", self.path)

    def touch(self) -> None:
        """Set the file's modification time to now, because this master is alive; :meth:`read` computes the age from it."""
        if self._lock is None:
            return
        with contextlib.suppress(OSError):
            os.utime(self.path, follow_symlinks=os.utime not in os.supports_follow_symlinks)

    def remove(self) -> None:
        """Remove the journal after a clean shutdown, so that nothing is recovered. Idempotent."""
        self._close_file()
        if self._lock is not None:
            self.discard()
        self.close()

    def close(self) -> None:
        """Close the file without removing it. Idempotent."""
        self._abandon()
        self._close_file()
        self.trouble = ""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _close_file(self) -> None:
        if self._file is not None:
            os.close(self._file)
            self._file = None

    @property
    def _new_path(self) -> Path:
        return self.path.with_name(self.path.name + ".new")

    @property
    def _copy_path(self) -> Path:
        return self.path.with_name(self.path.name + ".damaged")

    def _set_aside(self) -> Path | None:
        try:
            private_files.replace_file(self.path, self._copy_path)
        except OSError:
            return None
        return self._copy_path

    def _keep_copy(self, data: bytes) -> Path | None:
        copy = self._copy_path
        try:
            file = private_files.create_file(copy)
        except OSError:
            return None
        try:
            _write_all(file, data)
        except OSError:
            return None
        finally:
            os.close(file)
        return copy

    def _log_trouble(self) -> None:
        _log.error(
            "the journal %s cannot be written, a crash would lose the graph: %s", self.path, self.trouble
        )

    def _fail(self, error: Exception) -> None:
        self.trouble = _reason(error)
        self._failed_at = self._clock()
        self._abandon()
        self._close_file()


def _pieces_of(records: Iterable[list[object]]) -> Iterator[bytes]:
    """Yield the bytes of a complete journal, with large values in parts."""
    yield HEAD + serialize_record(["boot", boot_id()])
    written: list[bytes] = []
    for number, record in enumerate(records):
        if record[0] == "set" and not is_small(record[2]):
            # Use negative numbers, because values stored later get positive ones.
            for piece in pack_in_steps(record[2]):
                yield serialize_record(["part", -number - 1, piece])
            written.append(serialize_record(["put", record[1], -number - 1]))
        else:
            written.append(serialize_record(record))
        if len(written) == _STEP_RECORDS:
            yield b"".join(written)
            written.clear()
    yield b"".join(written)


class _Sync(threading.Thread):
    """A thread that syncs a file, which can be slow; ``error`` is the disk's error, if any."""

    def __init__(self, file: int) -> None:
        super().__init__(name="minirospy-journal-sync", daemon=True)
        self._file = file
        self.error: OSError | None = None

    def run(self) -> None:
        try:
            os.fsync(self._file)
        except OSError as error:
            self.error = error


def _reason(error: Exception) -> str:
    return (isinstance(error, OSError) and error.strerror) or str(error)


def _write_all(file: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(file, view) :]


def _locked(path: Path, journal: Path) -> int:
    """Lock a file that contains the process id; return its descriptor. The system releases the lock when this process exits.

    Raise JournalBusyError if another master has locked it, OSError if it cannot be locked.
    """
    file = private_files.open_file(path, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        if sys.platform == "win32":
            import msvcrt

            # Lock a byte after the process id, because other processes must be able to read the process id.
            os.lseek(file, 64, os.SEEK_SET)
            try:
                msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
            finally:
                os.lseek(file, 0, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _BUSY:
            text = os.read(file, 20).strip()
            os.close(file)
            raise JournalBusyError(journal, int(text) if text.isdigit() else 0) from error
        # The file system does not support locks. Continue, because no other master can have the same port.

    # The lock works even if a full disk prevents writing the process id.
    with contextlib.suppress(OSError):
        os.ftruncate(file, 0)
        os.write(file, b"%d\n" % os.getpid())
    return file


def boot_id() -> str:
    """Return an identifier of this machine's current boot; it only changes on a reboot."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        import psutil

        # On other systems the boot time is computed from the current time, so it varies by about a second.
        return str(round(psutil.boot_time() / 60))
