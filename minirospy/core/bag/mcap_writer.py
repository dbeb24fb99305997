"""Write messages and their times to an MCAP file, with the layout and profile (``ros1``) of the MCAP tools' bag converter.

A connection becomes a channel. The definition becomes a schema with the encoding ``ros1msg``; the connection header's
other fields except the type (md5sum, callerid, latching, ...) become the channel's metadata. Needs the extra
``minirospy[mcap]``. Sources: https://mcap.dev/spec, https://mcap.dev/spec/registry.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, BinaryIO, cast

from minirospy.base.errors import BagCompressionError, BagError, BagFormatError
from minirospy.base.installation import install_command
from minirospy.core.bag.writer import Buffer

if TYPE_CHECKING:
    from mcap.writer import Writer

__all__ = [
    "CHUNK_SIZE",
    "COMPRESSIONS",
    "SCHEMA_FIELDS",
    "McapWriter",
    "check_mcap",
    "check_mcap_compression",
]

CHUNK_SIZE = 4 * 1024 * 1024
"""Bytes per chunk before compression, as in the MCAP tools. The summary, which `rosbag info` reads, has one record per
chunk.
"""

# Dict from chunk compression to the library's name for it
COMPRESSIONS = {"none": "NONE", "lz4": "LZ4", "zstd": "ZSTD"}

SCHEMA_FIELDS = ("type", "message_definition")
"""The connection header's fields that form the channel's schema; the others are its metadata."""

_NEEDED = (*SCHEMA_FIELDS, "md5sum")


def check_mcap() -> None:
    """Raise BagError if the mcap library is missing; the error names the extra to install."""
    try:
        import mcap.records  # noqa: F401 - the rest is imported where it is needed
        import zstandard  # noqa: F401
    except ImportError as error:
        raise BagError(
            f"MCAP files need the library {error.name}: {install_command('minirospy[mcap]')}"
        ) from error


def check_mcap_compression(name: str) -> None:
    """Raise BagCompressionError unless chunks in MCAP files can be compressed with ``name``."""
    if name not in COMPRESSIONS:
        raise BagCompressionError(name, f"MCAP files have one of: {', '.join(COMPRESSIONS)}")


class McapWriter:
    """Like :class:`minirospy.core.bag.writer.BagWriter`, but writes an MCAP file. Does not close the stream.

    ``compression``: none, lz4 or zstd. Raise BagCompressionError if it is none of these, BagError if the extra is missing.
    """

    def __init__(self, stream: BinaryIO, *, compression: str = "none", chunk_size: int = CHUNK_SIZE) -> None:
        check_mcap_compression(compression)
        check_mcap()
        from mcap.writer import CompressionType, Writer

        self._stream = stream
        self._chunk_size = chunk_size
        self._is_plain = compression == "none"
        self._gathered = self._count = 0
        self._writer: Writer = Writer(
            cast(BinaryIO, _Whole(stream)),
            chunk_size=chunk_size,
            compression=CompressionType[COMPRESSIONS[compression]],
        )
        self._writer.start(profile="ros1", library="minirospy")
        self._schemas: dict[tuple[str, bytes], int] = {}
        self._closed = False

    @property
    def size(self) -> int:
        """The file's size so far in bytes, excluding data that is not compressed yet."""
        return self._stream.tell() + (self._gathered if self._is_plain else 0)

    @property
    def gathered(self) -> int:
        """The number of buffered bytes not yet written to the stream."""
        return self._gathered

    def add_connection(self, topic: str, header: Mapping[str, str | bytes]) -> int:
        """Add a connection; return its number, for :meth:`write`. Raise BagFormatError if the header lacks a required field."""
        for name in _NEEDED:
            if name not in header:
                raise BagFormatError(f'the connection header of {topic} has no field "{name}"')
        text = header["message_definition"]
        definition = text if isinstance(text, bytes) else text.encode("utf-8", "surrogateescape")
        fields = {name: _text(value) for name, value in header.items() if name not in SCHEMA_FIELDS}

        key = _text(header["type"]), definition
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(key[0], "ros1msg", definition)
        return self._writer.register_channel(topic, "ros1", self._schemas[key], fields)

    def write(self, connection: int, time: int, body: Buffer, *others: Buffer) -> None:
        """Write a message received at ``time``, in nanoseconds; its bytes are ``body`` followed by the others.

        Raise BagFormatError if the time is before 1970, OSError if the stream fails.
        """
        if time < 0:
            raise BagFormatError(f"the time {time} ns is before 1970")
        whole = b"".join((body, *others)) if others else body

        # Number the messages across all connections, like the MCAP tools' converter.
        sequence = self._count % 2**32
        self._gathered += len(whole)
        self._count += 1
        # A memoryview is fine, because the library copies it into the chunk.
        self._writer.add_message(connection, time, whole, time, sequence)  # type: ignore[arg-type]
        if self._gathered > self._chunk_size:
            self._gathered = 0

    def write_ready(self) -> None:
        """Do nothing, because complete chunks are compressed and written immediately."""

    def close(self) -> None:
        """Complete the file by writing its summary. Idempotent. Raise OSError if the stream fails."""
        if not self._closed:
            self._closed = True
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._stream.flush()

    def salvage(self, written: int | None = None) -> int:
        """Complete a file after its stream has failed; return the number of lost messages.

        The chunks already written are read back and kept, as in :meth:`minirospy.core.bag.writer.BagWriter.salvage`. Raise
        BagFormatError or OSError if even an empty file does not fit.
        """
        from minirospy.core.bag.mcap_repair import McapRepair

        self._closed = True
        repair = McapRepair(self._stream, written)
        for _ in repair.run():
            pass
        return self._count - repair.apply()


class _Whole:
    """A stream whose write() writes all data, even to an unbuffered file. The mcap library does its own buffering."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self.tell = stream.tell
        self.flush = stream.flush

    def write(self, data: bytes) -> int:
        count = self._stream.write(data)
        while count is not None and count < len(data):
            count += self._stream.write(memoryview(data)[count:])
        return len(data)


def _text(value: str | bytes) -> str:
    return value if isinstance(value, str) else value.decode("utf-8", "replace")
