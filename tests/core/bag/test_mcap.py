"""MCAP files: the mcap library and McapReader read McapWriter's files; bags survive conversion in both directions."""

from __future__ import annotations

import contextlib
import errno
import io
import random
import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import lz4.frame
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader

from minirospy.base.errors import (
    BagCompressionError,
    BagError,
    BagUnindexedError,
    McapUnindexedError,
    UsageError,
)
from minirospy.base.installation import install_command
from minirospy.core.bag.base import StoredMessage
from minirospy.core.bag.mcap_reader import McapReader, open_bag_or_mcap
from minirospy.core.bag.mcap_repair import McapRepair
from minirospy.core.bag.mcap_writer import McapWriter
from minirospy.core.bag.writer import BagWriter, Buffer
from minirospy.introspect.bag_convert import convert

HEADER = {
    "topic": "/chatter",
    "type": "std_msgs/String",
    "md5sum": "992ce8a1687cec8c8bd883ec73ca41d1",
    "message_definition": "# \N{GREEK SMALL LETTER PI}\nstring data\n",
    "callerid": "/talker",
    "latching": "1",
    "tcp_nodelay": "0",
}


def fill(writer: McapWriter | BagWriter, repeated: int = 100_000) -> None:
    """Write messages from two publishers, one of them out of order; the last one is large."""
    first = writer.add_connection("/chatter", HEADER)
    second = writer.add_connection("/other", {**HEADER, "callerid": "/second", "topic": "/chatter"})
    for i, time in enumerate((5, 3, 4, 6)):
        writer.write((first, second)[i % 2], 10**18 + time, b"\x01\0\0\0%d" % i)
    writer.write(first, 10**18 + 9, b"head", b"tail" * repeated)
    writer.close()


def made(compression: str = "none", repeated: int = 100_000) -> io.BytesIO:
    stream = io.BytesIO()
    fill(McapWriter(stream, compression=compression, chunk_size=50), repeated)
    stream.seek(0)
    return stream


def content(messages: list[StoredMessage]) -> list[tuple[int, bytes, str, dict[str, bytes]]]:
    """Return the parts that conversion must not change."""
    return [(one.time, one.body, one.connection.topic, one.connection.header) for one in messages]


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_the_library_reads_the_layout_of_ros1(compression: str) -> None:
    reader = make_reader(made(compression), validate_crcs=True)
    summary = reader.get_summary()
    assert summary

    assert reader.get_header().profile == "ros1"
    assert [(one.name, one.encoding) for one in summary.schemas.values()] == [("std_msgs/String", "ros1msg")]
    assert summary.schemas[1].data.decode() == HEADER["message_definition"]
    channel = summary.channels[1]
    assert (channel.topic, channel.message_encoding) == ("/chatter", "ros1")
    assert channel.metadata == {
        name: HEADER[name] for name in ("topic", "md5sum", "callerid", "latching", "tcp_nodelay")
    }
    messages = [message for _, _, message in reader.iter_messages()]
    assert [one.log_time - 10**18 for one in messages] == [3, 4, 5, 6, 9]
    assert sorted(one.sequence for one in messages) == [0, 1, 2, 3, 4]


def test_reading_imports_nothing_that_only_writing_needs() -> None:
    program = (
        "import sys\n"
        "from minirospy.core.bag.mcap_reader import open_bag_or_mcap\n"
        "open_bag_or_mcap(sys.stdin.buffer)\n"
        "print('mcap.stream_reader' in sys.modules, 'mcap.writer' in sys.modules)"
    )
    with tempfile.TemporaryFile() as file:
        file.write(made().getvalue())
        file.seek(0)
        done = subprocess.run(
            [sys.executable, "-c", program], stdin=file, capture_output=True, text=True, check=True
        )
    assert done.stdout == "True False\n"


def test_messages_are_read_in_the_order_of_time() -> None:
    reader = open_bag_or_mcap(made())

    assert isinstance(reader, McapReader)
    assert reader.connections[1].latching
    assert [one.time - 10**18 for one in reader.messages()] == [3, 4, 5, 6, 9]
    assert [one.time - 10**18 for one in reader.messages([1], 10**18 + 4, 10**18 + 5)] == [4, 5]
    assert sum(sum(chunk.counts.values()) for chunk in reader.chunks) == 5


@pytest.mark.parametrize("suffix", [".bag", ".mcap"])
def test_conversion_loses_nothing(suffix: str, tmp_path: Path) -> None:
    source = tmp_path / f"a{suffix}"
    with source.open("wb") as stream:
        fill(BagWriter(stream) if suffix == ".bag" else McapWriter(stream))
    other = tmp_path / ("b.mcap" if suffix == ".bag" else "b.bag")
    back = tmp_path / f"c{suffix}"
    convert(str(source), str(other), compression="lz4", force=False, step=lambda _: None)
    count = convert(str(other), str(back), compression="none", force=False, step=lambda _: None)

    assert count == 5
    found = []
    for path in (source, other, back):
        with path.open("rb") as stream:
            found.append(content(list(open_bag_or_mcap(stream).messages())))
    assert found[0] == found[1] == found[2]


def test_conversion_does_not_overwrite_files(tmp_path: Path) -> None:
    source = tmp_path / "a.mcap"
    source.write_bytes(made().getvalue())
    target = tmp_path / "b.bag"
    target.write_text("mine")
    for path, force in ((target, False), (source, True)):
        with pytest.raises(UsageError):
            convert(str(source), str(path), compression="none", force=force, step=lambda _: None)
    with pytest.raises(BagCompressionError):
        convert(str(source), str(tmp_path / "c.bag"), compression="zstd", force=False, step=lambda _: None)

    assert target.read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "b.bag"]


def test_a_cut_file_is_refused_or_read() -> None:
    whole = made("lz4").getvalue()
    for size in range(8, len(whole), 97):
        try:
            reader = McapReader(io.BytesIO(whole[:size]))
            list(reader.messages())
        except BagError:
            continue
        raise AssertionError(f"{size} of {len(whole)} bytes were taken for a whole file")


def test_a_flipped_byte_is_refused_or_read() -> None:
    whole = made().getvalue()
    for at in [*range(8, 400), *range(len(whole) - 600, len(whole))]:
        data = bytearray(whole)
        data[at] ^= 0x11
        try:
            list(McapReader(io.BytesIO(bytes(data))).messages())
        except BagError:
            pass


def test_a_file_without_a_summary_is_named() -> None:
    from mcap.writer import IndexType, Writer

    stream = io.BytesIO()
    writer = Writer(
        stream,
        index_types=IndexType.NONE,
        use_statistics=False,
        use_summary_offsets=False,
        repeat_channels=False,
        repeat_schemas=False,
    )
    writer.start()
    writer.finish()  # type: ignore[no-untyped-call]
    stream.seek(0)

    with pytest.raises(BagUnindexedError):
        McapReader(stream)


def repaired(data: bytes) -> tuple[McapRepair, io.BytesIO]:
    stream = io.BytesIO(data)
    repair = McapRepair(stream)
    positions = list(repair.run())
    assert positions == sorted(set(positions))
    repair.apply()
    stream.seek(0)
    return repair, stream


def library_reads(stream: io.BytesIO) -> list[tuple[int, bytes]]:
    """Return times and bodies as the mcap library reads them, with the summary and without it."""
    stream.seek(0)
    by_summary = [(each.log_time, each.data) for _, _, each in make_reader(stream).iter_messages()]
    stream.seek(0)
    by_stream = [
        (each.log_time, each.data)
        for each in StreamReader(stream, validate_crcs=True).records
        if isinstance(each, Message)
    ]
    assert by_summary == sorted(by_stream)
    return by_summary


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_a_file_that_is_cut_off_is_repaired_up_to_its_last_whole_chunk(compression: str) -> None:
    whole = made(compression, 100 if compression == "none" else 100_000)
    expected = library_reads(whole)
    data = whole.getvalue()
    last = 0
    # The data after the chunks is never compressed.
    step = 1 if compression == "none" else 7
    for size in [
        *range(60, len(data) - 700, len(data) // 100),
        *range(len(data) - 700, len(data), step),
        len(data),
    ]:
        _, stream = repaired(data[:size])
        found = library_reads(stream)
        assert set(found) <= set(expected)
        assert len(found) >= last
        last = len(found)
        reader = McapReader(stream)
        assert len(list(reader.messages())) == len(found) == reader.statistics.message_count
    assert found == expected
    with pytest.raises(BagError, match="not whole"):
        repaired(data[:12])


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_a_damaged_chunk_costs_its_own_messages_alone(compression: str) -> None:
    data = bytearray(made(compression).getvalue())
    second = McapReader(io.BytesIO(bytes(data))).chunks[1]
    data[second.position + 70] ^= 0xFF

    repair, stream = repaired(bytes(data))

    assert len(repair.problems) == 1
    assert f"record at byte {second.position}: not a whole MCAP file: " in repair.problems[0]
    assert 0 < len(list(McapReader(stream).messages())) < 5


class Full(io.BytesIO):
    """A disk with space for a number of bytes."""

    room = 0

    def write(self, data: Buffer, /) -> int:  # type: ignore[override]
        if self.tell() + len(data) > self.room:
            super().write(bytes(data)[: max(self.room - self.tell(), 0)])
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)


@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_a_full_disk_leaves_a_readable_file(compression: str) -> None:
    lengths = []
    for room in range(1500, 20_000, 500):
        stream = Full()
        stream.room = room
        writer = McapWriter(stream, compression=compression, chunk_size=200)
        connection = writer.add_connection("/chatter", HEADER)
        count = 0
        try:
            for count in range(1, 201):
                writer.write(connection, count, b"%060d" % count)
            writer.close()
            lost = 0
        except OSError:
            lost = writer.salvage()

        found = library_reads(stream)
        assert len(found) == count - lost
        assert [time for time, _ in found] == list(range(1, len(found) + 1))
        lengths.append(len(found))
    assert lengths == sorted(lengths)
    assert lengths[0] < 20
    assert lengths[-1] > 50


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "zstandard", None)

    with pytest.raises(BagError, match=re.escape(install_command("minirospy[mcap]"))):
        McapWriter(io.BytesIO())
    with pytest.raises(BagError, match=re.escape(install_command("minirospy[mcap]"))):
        open_bag_or_mcap(made_bytes())


def made_bytes() -> io.BytesIO:
    return io.BytesIO(b"\x89MCAP0\r\n" + bytes(100))


def made_by_the_library(seed: int, **options: Any) -> bytes:
    """Return a file with three channels, one of which is not ROS 1, and times in random order."""
    from mcap.writer import Writer

    source = random.Random(seed)
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=200, **options)
    writer.start(profile="ros1")
    schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data\n")
    channels = [
        writer.register_channel(topic, encoding, schema)
        for topic, encoding in (("/a", "ros1"), ("/b", "ros1"), ("/c", "json"))
    ]
    for number in range(60):
        writer.add_message(
            source.choice(channels),
            log_time=source.randrange(20),
            data=source.randbytes(source.randrange(40)),
            publish_time=0,
            sequence=number,
        )
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("index", ["ALL", "NONE", "CHUNK"])
@pytest.mark.parametrize("kind", ["NONE", "LZ4", "ZSTD", "loose"])
def test_messages_are_those_of_the_library_in_its_order(seed: int, index: str, kind: str) -> None:
    from mcap.writer import CompressionType, IndexType

    data = made_by_the_library(
        seed,
        compression=CompressionType["NONE" if kind == "loose" else kind],
        index_types=IndexType[index],
        use_chunking=kind != "loose",
    )
    reader = McapReader(io.BytesIO(data))
    for topics in (["/a", "/b"], ["/b"]):
        for start, end in ((None, None), (5, 10), (10, 5)):
            wanted = [one.id for one in reader.connections.values() if one.topic in topics]
            found = [
                (one.time, one.connection.topic, one.body) for one in reader.messages(wanted, start, end)
            ]
            theirs = make_reader(io.BytesIO(data)).iter_messages(topics)
            assert found == [
                (message.log_time, channel.topic, message.data)
                for _, channel, message in theirs
                if (start or 0) <= message.log_time <= (100 if end is None else end)
            ]


@pytest.mark.parametrize("mask", [0x80, 0xFF, 0x01])
@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_any_flipped_byte_raises_a_minirospy_error(compression: str, mask: int) -> None:
    # A length of 2^63 bytes used to raise OverflowError, one of 2^40 MemoryError.
    # Without compression, each byte of a large message would be copied and summed for each flipped one.
    whole = made(compression, 100 if compression == "none" else 100_000).getvalue()
    step = max(1, len(whole) // 1_500)
    for at in sorted({*range(0, len(whole), step), *range(len(whole) - 700, len(whole))}):
        data = bytearray(whole)
        data[at] ^= mask
        for action in (lambda stream: list(open_bag_or_mcap(stream).messages()), repaired_stream):
            with contextlib.suppress(BagError):
                action(io.BytesIO(bytes(data)))


def repaired_stream(stream: io.BytesIO) -> None:
    repair = McapRepair(stream)
    list(repair.run())
    repair.apply()


def with_chunk(compression: str, stored: bytes, size: int) -> bytes:
    """Return a file whose only chunk has this data and claims a size of ``size`` bytes."""
    whole = made().getvalue()
    reader = McapReader(io.BytesIO(whole))
    (first, *_) = reader._summary.chunk_indexes
    start = first.chunk_start_offset
    record = struct.pack("<QQQII", 0, 1, size, 0, len(compression)) + compression.encode()
    record += struct.pack("<Q", len(stored)) + stored
    chunk = struct.pack("<BQ", 6, len(record)) + record
    head = whole[:start] + chunk
    repair = McapRepair(stream := io.BytesIO(head))
    list(repair.run())
    repair.apply()
    # The repair does not index a decompression bomb: a reader then finds the chunk by reading the file.
    return stream.getvalue()


@pytest.mark.parametrize(
    ("compression", "stored", "size", "why"),
    [
        (
            "zstd",
            zstandard.compress(bytes(1 << 20)),
            1 << 62,
            "a compressed chunk of 4611686018427387904 bytes",
        ),
        ("zstd", zstandard.compress(bytes(1 << 20)), 1000, "a chunk has more than 1000 bytes"),
        ("zstd", zstandard.compress(bytes(1000)), 1001, "a chunk has 1000 bytes instead of 1001"),
        ("zstd", zstandard.compress(bytes(1 << 20))[:-9], 1 << 20, "a chunk has"),
        ("zstd", b"no", 2, "Zstandard frame is damaged"),
        ("lz4", lz4.frame.compress(bytes(1 << 20)), 1000, "a chunk has more than 1000 bytes"),
        ("lz4", b"no", 2, "LZ4 frame is truncated"),
        ("snappy", b"no", 2, "unsupported compression type: snappy"),
    ],
)
def test_a_bomb_in_a_chunk_is_refused(compression: str, stored: bytes, size: int, why: str) -> None:
    data = with_chunk(compression, stored, size)
    reader = McapReader(io.BytesIO(data))
    assert not reader.chunks
    with pytest.raises(BagError, match=why):
        list(reader.messages())


def test_a_summary_that_names_a_chunk_twice_is_damaged() -> None:
    repair = McapRepair(stream := made())
    list(repair.run())
    repair._chunks.append(repair._chunks[0])
    repair.apply()
    with pytest.raises(McapUnindexedError, match="its summary names a chunk twice"):
        McapReader(stream)


def test_no_connections_have_no_messages() -> None:
    reader = McapReader(made())
    assert not list(reader.messages([]))
    assert reader.index([]) == []
    assert len(list(reader.messages())) == 5
