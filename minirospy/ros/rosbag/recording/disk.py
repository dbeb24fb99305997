"""Writes files in a thread, so that the caller does not wait for the disk.

:attr:`DiskThread.pending` counts the queued bytes; the caller decides how to limit them.
"""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Callable
from pathlib import Path

from minirospy.base.private_files import open_file

__all__ = ["DiskThread", "QueuedFile"]

Buffer = bytes | bytearray | memoryview


class DiskThread:
    """Starts a thread that runs queued calls in order. ``close`` waits until the queue is empty.

    If a call raises an exception, ``on_error(error)`` is called in that thread, and then the next call runs.
    """

    def __init__(self, on_error: Callable[[Exception], object]) -> None:
        self._on_error = on_error
        self._queue: queue.SimpleQueue[tuple[Callable[[], object], int] | None] = queue.SimpleQueue()
        # Each counter is written by only one thread, so no lock is needed.
        self._queued = self._done = 0
        self._thread = threading.Thread(target=self._run, name="rosbag-disk")
        self._thread.start()

    @property
    def pending(self) -> int:
        """Return the number of bytes that are queued but not yet written."""
        return self._queued - self._done

    @property
    def is_current(self) -> bool:
        """Return whether the calling thread is the disk thread."""
        return threading.current_thread() is self._thread

    def submit(self, function: Callable[[], object], size: int = 0) -> None:
        """Queue a call that writes ``size`` bytes. Not thread-safe: callers must serialize their calls."""
        self._queued += size
        self._queue.put((function, size))

    def close(self) -> None:
        """Wait until all queued calls are done, then stop the thread."""
        self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            function, size = item
            try:
                function()
            except Exception as error:  # noqa: BLE001 - later calls must still complete their files
                self._on_error(error)
            self._done += size


class QueuedFile:
    """A new file written by the disk thread, with the stream methods that a bag writer needs.

    Calls are queued, except that a call from the disk thread runs immediately.

    At the first error, ``on_error(error)`` is called in the disk thread, and the file's other queued calls are dropped.
    Raise OSError if the file cannot be created.
    """

    def __init__(self, disk: DiskThread, path: Path, on_error: Callable[[Exception], object]) -> None:
        self.path = path
        self._disk = disk
        self._on_error = on_error
        self._position = 0
        self.failed = False
        # open_file() does not follow symbolic links, which an attacker could create under the predictable file name.
        opened = open_file(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC)
        self._file = os.fdopen(opened, "r+b", buffering=0)

    def write(self, data: Buffer) -> int:
        """Queue a write of all ``data``, which must not change after the call."""
        size = len(data)
        self._position += size
        self._do(lambda: self._write_all(data), size)
        return size

    def read(self, size: int = -1) -> bytes:
        """Return the bytes at the current position. Call this only in the disk thread."""
        data = self._file.read(size) or b""
        self._position += len(data)
        return data

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Seek relative to the start or the end of the file."""
        if whence == os.SEEK_END:
            # Do nothing: a writer seeks to the end only after its last write.
            return self._position
        self._position = offset
        self._do(lambda: self._file.seek(offset))
        return offset

    def truncate(self, size: int | None = None) -> int:
        """Truncate the file at the current position, or at ``size``."""
        position = self._position if size is None else size
        self._do(lambda: self._file.truncate(position))
        return position

    def tell(self) -> int:
        """Return the position of the next write."""
        return self._position

    def flush(self) -> None:
        """Do nothing: the file is unbuffered."""

    def written(self) -> int:
        """Return the file size in bytes. Call this only in the disk thread."""
        return os.fstat(self._file.fileno()).st_size

    def close_file(self) -> None:
        """Close the file after the queued writes."""
        self._do(self._file.close)

    def _do(self, call: Callable[[], object], size: int = 0) -> None:
        if self._disk.is_current:
            call()
        else:
            self._disk.submit(lambda: self._try(call), size)

    def _try(self, call: Callable[[], object]) -> None:
        if self.failed:
            return
        try:
            call()
        except Exception as error:  # noqa: BLE001 - reported; the next file is still written
            self.failed = True
            self._on_error(error)

    def _write_all(self, data: Buffer) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]
