"""A file in a recording. The disk thread writes it as ``NAME.active``, and renames it when it is complete."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import BinaryIO, Protocol, cast

from minirospy.base import private_files
from minirospy.base.errors import BagFormatError
from minirospy.core.bag.writer import BagWriter, Buffer
from minirospy.ros.rosbag.recording.disk import DiskThread, QueuedFile
from minirospy.ros.rosbag.recording.options import RecordOptions

__all__ = ["BagFile", "FileWriter"]

_UNLIMITED = 2**31
_KNOWN_HEADERS = 10_000
_DEFAULTS = {"message_definition": "", "md5sum": "*", "type": "*"}
"""Fields that a bag requires but third-party publishers may omit from their connection headers."""


class FileWriter(Protocol):
    """Interface of the writers for bags and MCAP files."""

    @property
    def size(self) -> int:
        """Return the current file size in bytes."""

    @property
    def gathered(self) -> int:
        """Return the number of buffered bytes not yet passed to the stream."""

    def add_connection(self, topic: str, header: Mapping[str, str | bytes]) -> int:
        """Add a connection and return its number."""

    def write(self, connection: int, time: int, body: Buffer, *others: Buffer) -> None:
        """Write a message, given in one part or more."""

    def write_ready(self) -> None:
        """Write the complete chunks whose compression has finished."""

    def close(self) -> None:
        """Write the end of the file."""

    def salvage(self, written: int | None = None) -> int:
        """Complete a file after its stream has failed; return the number of lost messages."""


class BagFile:
    """A bag being recorded. Call its methods with ``lock`` held.

    ``on_error(file, error, lost)`` is called in the disk thread if the disk or a compression fails. By then, the file has
    its final name and is readable, but ``lost`` messages are missing (-1: the file could not be completed). Raise OSError
    if the file cannot be created.
    """

    def __init__(
        self,
        name: str,
        options: RecordOptions,
        disk: DiskThread,
        lock: threading.Lock,
        executor: Executor | None,
        on_error: Callable[[BagFile, Exception, int], object],
    ) -> None:
        self.name = name
        self._path = Path(name)
        self._active = Path(f"{name}.active")
        self._report = on_error
        self._is_closed = False

        self._disk = disk
        self._lock = lock
        self._stream = QueuedFile(disk, self._active, self._failed)
        self._writer = _open_writer(self._stream, options, executor)
        self._by_identity: dict[int, tuple[Mapping[str, str], int]] = {}
        self._by_content: dict[tuple[str, frozenset[tuple[str, str]]], int] = {}

    @property
    def active_name(self) -> str:
        """Return the temporary file name used while recording."""
        return str(self._active)

    @property
    def size(self) -> int:
        """Return the current file size in bytes."""
        return self._writer.size

    @property
    def gathered(self) -> int:
        """Return the number of buffered bytes, excluding those in the disk thread's queue."""
        return self._writer.gathered

    def write(self, topic: str, header: Mapping[str, str], time: int, *parts: Buffer) -> None:
        """Write a message received with this connection header, given in one part or more.

        Raise BagFormatError if the bag format cannot store the message.
        """
        if self._is_closed:
            return
        # All messages from a connection share one header object.
        known = self._by_identity.get(id(header))
        number = known[1] if known and known[0] is header else self._connection(topic, header)
        try:
            self._writer.write(number, time, *parts)
        except BagFormatError:
            raise
        except Exception as error:  # noqa: BLE001 - a compression may fail with any exception
            self._give_up(error)

    def write_ready(self) -> None:
        """Write the chunks that have been compressed since the last message."""
        if not self._is_closed:
            try:
                self._writer.write_ready()
            except Exception as error:  # noqa: BLE001 - as above
                self._give_up(error)

    def close(self) -> None:
        """Complete the file in the disk thread, after the queued writes."""
        self._disk.submit(self._finish)

    def _connection(self, topic: str, header: Mapping[str, str]) -> int:
        # A reconnecting publisher with the same header keeps its connection number.
        key = topic, frozenset(header.items())
        number = self._by_content.get(key)
        if number is None:
            number = self._by_content[key] = self._writer.add_connection(
                topic, {**_DEFAULTS, **dict(sorted(header.items())), "topic": topic}
            )
        if len(self._by_identity) > _KNOWN_HEADERS:
            self._by_identity.clear()
        self._by_identity[id(header)] = header, number
        return number

    def _finish(self) -> None:
        if self._is_closed:
            return
        self._is_closed = True
        try:
            self._writer.close()
            self._stream.close_file()
            private_files.replace_file(self._active, self._path)
        except Exception as error:  # noqa: BLE001 - compressing a chunk may fail too, e.g. with MemoryError
            self._salvage(error)

    def _give_up(self, error: Exception) -> None:
        """Complete the file after its queued writes, because compressing a chunk has failed."""
        self._is_closed = True
        self._disk.submit(lambda: self._salvage(error))

    def _failed(self, error: Exception) -> None:
        with self._lock:
            if self._is_closed:
                return
            # Reject further writes.
            self._is_closed = True
        self._salvage(error)

    def _salvage(self, error: Exception) -> None:
        lost = -1
        with contextlib.suppress(Exception):
            lost = self._writer.salvage(self._stream.written())
        with contextlib.suppress(OSError):
            self._stream.close_file()
            if lost >= 0:
                private_files.replace_file(self._active, self._path)
        self._report(self, error, lost)


def _open_writer(file: QueuedFile, options: RecordOptions, executor: Executor | None) -> FileWriter:
    stream = cast(BinaryIO, file)
    if options.mcap:
        from minirospy.core.bag.mcap_writer import McapWriter

        return McapWriter(stream, compression=options.compression, chunk_size=options.chunk_size)
    return BagWriter(
        stream,
        compression=options.compression,
        chunk_threshold=options.chunk_size,
        executor=executor,
        # no limit here, because the recorder itself limits the number of queued bytes
        max_waiting=_UNLIMITED,
    )
