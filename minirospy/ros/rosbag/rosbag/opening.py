"""The base class of rosbag.Bag. Opens a file to read, write or append, and creates its reader and writer."""

from __future__ import annotations

import io
import os
from collections.abc import Iterable, Mapping
from typing import Any, BinaryIO, TypeAlias, cast

from minirospy.base.errors import BagUnindexedError
from minirospy.core.bag.base import BagReader
from minirospy.core.bag.old_formats import unindexed_old_bag
from minirospy.core.bag.reader import ChunkedReader, open_bag
from minirospy.core.bag.records import ChunkInfo, Connection, read_version
from minirospy.core.bag.writer import BagWriter, Continued
from minirospy.ros.rosbag.rosbag.exceptions import ROSBagException, ROSBagUnindexedException
from minirospy.ros.rosbag.rosbag.private import PrivateBag

__all__ = ["CLOSED", "FileArgument", "OpenedBag"]

FileArgument: TypeAlias = str | os.PathLike[str] | BinaryIO
"""A bag's source or target: a path or an open file."""

CLOSED = "I/O operation on closed bag"
FIRST_RECORD = len("#ROSBAG V2.0\n")  # position of the file header record


class OpenedBag(PrivateBag):
    """An open bag: its file, and its reader or writer."""

    def __init__(self, mode: str, compression: str, chunk_threshold: int) -> None:
        self._compression = compression
        self._chunk_threshold = chunk_threshold
        self._file: BinaryIO | None = None
        self._filename: str | os.PathLike[str] | None = None
        self._version: int | None = None
        self._mode = mode
        self._source: BagReader | None = None
        """The file's reader. It is not named ``_reader``, because programs may replace an attribute of that name."""
        self._writer: BagWriter | None = None
        self._file_header_pos = FIRST_RECORD
        self._is_read = False  # whether a read may have moved the file position since the last write

    @property
    def _index_data_pos(self) -> int:
        """Return the position of the connection and chunk info records, or 0 if the bag is being written or has no index."""
        return (
            self._source.index_position
            if isinstance(self._source, ChunkedReader) and self._mode == "r"
            else 0
        )

    @property
    def _output_file(self) -> BinaryIO | None:
        """Return the output file. In the real module, this attribute is the file only if no chunk is open."""
        return self._file

    def _current(self) -> BagReader:
        """Return a reader that includes the connections and chunks written so far."""
        stream = self._open_file()
        reader = self._source
        if reader is None:
            reader = self._source = ChunkedReader(stream, {}, self._writer.chunks if self._writer else [])
        if self._writer:
            self._is_read = True
            for connection in self._writer.connections:
                reader.connections.setdefault(connection.id, connection)
        return reader

    def _open_read(self, f: FileArgument, allow_unindexed: bool) -> None:
        stream = self._file = self._take(f, "rb")
        position = stream.tell()
        self._version = read_version(stream)
        stream.seek(position)
        try:
            self._source = open_bag(stream)
        except BagUnindexedError:
            if not allow_unindexed:
                raise
            if self._version < 200:
                stream.seek(position)
                self._source = unindexed_old_bag(stream)

    def _open_write(self, f: FileArgument, allow_unindexed: bool) -> None:
        self._file = self._take(f, "w+b")
        self._version = 200
        self._writer = BagWriter(
            self._file, compression=self._compression, chunk_threshold=self._chunk_threshold
        )

    def _open_append(self, f: FileArgument, allow_unindexed: bool) -> None:
        if isinstance(f, (str, os.PathLike)) and not os.path.exists(f):
            self._open_write(f, allow_unindexed)
            return
        stream = self._file = self._take(f, "r+b")
        position = stream.tell()
        self._version = read_version(stream)
        if self._version != 200:
            raise ROSBagException(f"bag version {self._version} is unsupported for appending")
        stream.seek(position)
        try:
            reader = open_bag(stream)
        except BagUnindexedError:
            if not allow_unindexed:
                raise
            return
        assert isinstance(reader, ChunkedReader)
        self._start_appending(reader.connections, reader.chunks, reader.index_position)

    def _start_appending(
        self, connections: Mapping[int, Connection], chunks: Iterable[ChunkInfo], position: int
    ) -> None:
        self._writer = BagWriter(
            self._open_file(),
            compression=self._compression,
            chunk_threshold=self._chunk_threshold,
            continued=Continued(connections.values(), chunks, position),
        )
        self._source = None

    def _take(self, f: Any, mode: str) -> BinaryIO:
        """Return ``f`` if it is an open file; otherwise open the file at the path ``f``."""
        if not self._is_file(f):
            self._filename = f
            return cast("BinaryIO", open(f, mode))
        if isinstance(f, io.TextIOBase):
            raise ROSBagException("In Python 3 the bag file must be opened in binary mode")
        return cast("BinaryIO", f)

    @staticmethod
    def _is_file(f: object) -> bool:
        """Return whether ``f`` is an open file, not a path."""
        return isinstance(f, io.IOBase)

    def _open_file(self) -> BinaryIO:
        if self._file is None:
            raise ValueError(CLOSED)
        return self._file

    def _not_writable(self) -> Exception:
        return io.UnsupportedOperation("write") if self._mode == "r" else ROSBagUnindexedException()

    def _close_file(self) -> None:
        if self._source:
            self._source.close()
        if self._file is not None:
            self._file.close()
            self._file = None
