"""BagWriter: the same bytes as rosbag's Python writer, only complete chunks, a readable bag when the disk is full."""

from __future__ import annotations

import errno
import hashlib
import io
import mmap
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import BagFormatError
from minirospy.core.bag import records
from minirospy.core.bag.compression import BZ2, COMPRESSIONS, NONE, decompress
from minirospy.core.bag.writer import BagWriter, Buffer, Continued
from tests.core.bag.bags import Index, parse_index

SECOND = 10**9
MESSAGES = 40
DEFINITION = {
    "type": "std_msgs/String",
    "md5sum": "992ce8a1687cec8c8bd883ec73ca41d1",
    "message_definition": "string data\n",
}


def header(topic: str) -> dict[str, str]:
    return {"topic": topic, **DEFINITION}


class Disk(io.BytesIO):
    """A stream that accepts ``room`` bytes, at most ``step`` of them per write, and records them."""

    def __init__(self, room: int = sys.maxsize, step: int = sys.maxsize) -> None:
        super().__init__()
        self.room = room
        self.step = step
        self.given: list[object] = []

    def write(self, data: Buffer) -> int:  # type: ignore[override]
        self.given.append(data)
        free = self.room - self.tell()
        if data and free <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(memoryview(data)[: min(self.step, free)])


class Parsed:
    """A complete bag, parsed: its header, connections, chunk infos, and its messages in file order."""

    def __init__(self, data: bytes) -> None:
        stream = io.BytesIO(data)
        assert stream.readline() == records.MAGIC
        self.messages: list[tuple[int, int, bytes]] = []
        self.indexes: list[Index] = []
        self.connections: list[records.Connection] = []
        self.chunks: list[records.ChunkInfo] = []
        self.compressions: list[str] = []

        for record, body in self._records(stream, len(data)):
            if record.op == records.OP_BAG_HEADER:
                self.header = records.parse_bag_header(record)
            elif record.op == records.OP_CHUNK:
                self._add_chunk(records.parse_chunk_header(record), body)
            elif record.op == records.OP_INDEX_DATA:
                self.indexes.append(parse_index(record, body))
            elif record.op == records.OP_CONNECTION:
                self.connections.append(records.parse_connection(record, body))
            else:
                self.chunks.append(records.parse_chunk_info(record, body))
        assert self.header.connection_count == len(self.connections)
        assert self.header.chunk_count == len(self.chunks)

    @staticmethod
    def _records(stream: io.BytesIO, size: int) -> Iterator[tuple[records.Record, bytes]]:
        while stream.tell() < size:
            record = records.read_record(stream, size)
            yield record, stream.read(record.data_size)

    def _add_chunk(self, chunk: records.Chunk, body: bytes) -> None:
        self.compressions.append(chunk.compression)
        data = decompress(chunk.compression, body, chunk.size)
        for record in records.parse_records(data):
            if record.op == records.OP_MESSAGE_DATA:
                found = data[record.data_position : record.end]
                self.messages.append(tuple(records.parse_message_data(record, found)))


def test_bytes_are_those_of_rosbag() -> None:
    # The checksum of a bag that Debian's rosbag 1.15.15 wrote: Bag(f, "w", chunk_threshold=100), four messages.
    wanted = "b86940be2fcbbadc8243e6fbc0cd1ddbb7a52f4375b5aa835d33eb4c278826a5"
    stream = io.BytesIO()
    writer = BagWriter(stream, chunk_threshold=100)
    numbers = {topic: writer.add_connection(topic, header(topic)) for topic in ("/b", "/a")}

    for i in range(4):
        body = b"\2\0\0\0x%d" % i
        writer.write(numbers["/a" if i % 2 else "/b"], (10 + i) * SECOND + 5, body)
    writer.close()

    assert hashlib.sha256(stream.getvalue()).hexdigest() == wanted


def test_indexes_are_in_the_order_of_time() -> None:
    stream = io.BytesIO()
    writer = BagWriter(stream)
    number = writer.add_connection("/a", header("/a"))
    for time in (5, 3, 4):
        writer.write(number, time * SECOND, b"%d" % time)
    writer.close()

    bag = Parsed(stream.getvalue())

    assert [body for _, _, body in bag.messages] == [b"5", b"3", b"4"]
    assert [time // SECOND for time, _ in bag.indexes[0].entries] == [3, 4, 5]
    assert (bag.chunks[0].start_time, bag.chunks[0].end_time) == (3 * SECOND, 5 * SECOND)
    assert bag.chunks[0].counts == {number: 3}


def test_large_messages_are_not_copied() -> None:
    stream = Disk()
    writer = BagWriter(stream)
    number = writer.add_connection("/a", header("/a"))
    image, changeable = bytes(1_000_000), bytearray(200_000)

    writer.write(number, 1, memoryview(b"width"), image)
    writer.write(number, 2, changeable)
    changeable[:] = b"x" * len(changeable)
    writer.close()

    assert any(data is image for data in stream.given)
    assert [body for _, _, body in Parsed(stream.getvalue()).messages] == [b"width" + image, bytes(200_000)]


def test_a_stream_may_take_a_part() -> None:
    whole, slow = io.BytesIO(), Disk(step=7)
    for stream in (whole, slow):
        writer = BagWriter(stream, chunk_threshold=1000)
        number = writer.add_connection("/a", header("/a"))
        for time in range(50):
            writer.write(number, time, b"x" * 100)
        writer.close()

    assert slow.getvalue() == whole.getvalue()


def test_chunks_are_compressed_in_parallel_in_order() -> None:
    alone, parallel = io.BytesIO(), io.BytesIO()
    with ThreadPoolExecutor(3) as executor:
        for stream, threads in ((alone, None), (parallel, executor)):
            writer = BagWriter(stream, compression=BZ2, chunk_threshold=10_000, executor=threads)
            number = writer.add_connection("/a", header("/a"))
            for time in range(2000):
                writer.write(number, time, b"%d" % time * 10)
            writer.close()

    assert alone.getvalue() == parallel.getvalue()
    assert [time for _, time, _ in Parsed(alone.getvalue()).messages] == list(range(2000))


def test_compression_changes_between_chunks() -> None:
    stream = io.BytesIO()
    writer = BagWriter(stream)
    number = writer.add_connection("/a", header("/a"))
    writer.write(number, 1, b"one")
    writer.compression = BZ2
    writer.write(number, 2, b"two")
    writer.close()

    bag = Parsed(stream.getvalue())

    assert bag.compressions == [NONE, BZ2]
    assert [body for _, _, body in bag.messages] == [b"one", b"two"]


def test_a_bag_is_continued() -> None:
    stream = io.BytesIO()
    writer = BagWriter(stream)
    writer.write(writer.add_connection("/a", header("/a")), 1, b"one")
    writer.close()
    before = Parsed(stream.getvalue())

    end = before.header.index_pos
    writer = BagWriter(stream, continued=Continued(before.connections, before.chunks, end))
    assert len(stream.getvalue()) == end
    writer.write(0, 2, b"two")
    number = writer.add_connection("/b", header("/b"))
    writer.write(number, 3, b"three")
    writer.close()
    after = Parsed(stream.getvalue())

    assert [body for _, _, body in after.messages] == [b"one", b"two", b"three"]
    assert [one.topic for one in after.connections] == ["/a", "/b"]
    assert after.chunks[0] == before.chunks[0]
    assert [chunk.counts for chunk in after.chunks] == [{0: 1}, {0: 1, number: 1}]


def test_a_connection_without_messages_is_left_out() -> None:
    stream = io.BytesIO()
    writer = BagWriter(stream)
    writer.add_connection("/a", header("/a"))
    number = writer.add_connection("/b", header("/b"))
    writer.write(number, 1, b"one")
    writer.close()

    assert [one.id for one in Parsed(stream.getvalue()).connections] == [number]
    assert writer.connections == Parsed(stream.getvalue()).connections


@pytest.mark.skipif(sys.maxsize < 2**32, reason="no such messages in 32 bits")
def test_a_message_of_4_gib_is_refused() -> None:
    stream = io.BytesIO()
    writer = BagWriter(stream)
    number = writer.add_connection("/big", header("/big"))
    writer.write(number, 1, b"one")

    with (
        mmap.mmap(-1, 2**32) as untouched,
        memoryview(untouched) as body,
        pytest.raises(BagFormatError, match="4294967296 bytes on /big is too large"),
    ):
        writer.write(number, 2, body)
    writer.write(number, 3, b"three")
    writer.close()

    assert [body for _, _, body in Parsed(stream.getvalue()).messages] == [b"one", b"three"]


def test_a_chunk_ends_before_it_is_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.core.bag.writer.MAX_UINT32", 1000)
    stream = io.BytesIO()
    writer = BagWriter(stream, chunk_threshold=2**40)
    numbers = [writer.add_connection(topic, header(topic)) for topic in ("/a", "/b")]
    for time in range(20):
        writer.write(numbers[time % 2], time, b"x" * 300)
    writer.close()

    bag = Parsed(stream.getvalue())

    assert [time for _, time, _ in bag.messages] == list(range(20))
    assert len(bag.chunks) > 6


@pytest.mark.parametrize("time", [-1, (2**32) * SECOND])
def test_a_time_that_does_not_fit_is_refused(time: int) -> None:
    stream = io.BytesIO()
    writer = BagWriter(stream)
    number = writer.add_connection("/a", header("/a"))
    with pytest.raises(BagFormatError, match="from 0 to 2106"):
        writer.write(number, time, b"one")
    writer.write(number, 1, b"two")
    writer.close()

    assert [body for _, _, body in Parsed(stream.getvalue()).messages] == [b"two"]


def test_a_header_without_its_type_is_refused() -> None:
    with pytest.raises(BagFormatError, match='of /a has no field "md5sum"'):
        BagWriter(io.BytesIO()).add_connection("/a", {"type": "std_msgs/String"})


@pytest.mark.parametrize("late", [False, True])
def test_a_full_disk_leaves_a_readable_bag(late: bool) -> None:
    whole = io.BytesIO()
    fill(BagWriter(whole, chunk_threshold=500))
    sizes: set[int] = set()

    for room in range(4117, len(whole.getvalue()), 61):
        stream = Disk(room)
        # A stream that writes in another thread reports the error later: data accepted in between is not in the file.
        writer = BagWriter(Late(stream) if late else stream, chunk_threshold=500)
        with pytest.raises(OSError, match="No space left"):
            fill(writer)
        lost = writer.salvage(len(stream.getvalue()))

        times = [time for _, time, _ in Parsed(stream.getvalue()).messages]
        assert times == list(range(len(times)))
        assert 0 < lost <= MESSAGES - len(times)
        assert len(stream.getvalue()) <= room
        sizes.add(len(times))
    assert len(sizes) > 5


class Late(io.RawIOBase):
    """A stream that reports an error of the stream behind it one write later."""

    def __init__(self, behind: Disk) -> None:
        super().__init__()
        self._behind = behind
        self._fault: OSError | None = None

    def write(self, data: Buffer) -> int:  # type: ignore[override]
        if self._fault:
            fault, self._fault = self._fault, None
            raise fault
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._behind.write(rest) :]
        except OSError as error:
            self._fault = error
        return len(data)

    def tell(self) -> int:
        return self._behind.tell()

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self.flush()
        return self._behind.seek(offset, whence)

    def flush(self) -> None:
        if self._fault:
            fault, self._fault = self._fault, None
            raise fault

    def truncate(self, size: int | None = None) -> int:
        return self._behind.truncate(size)


def fill(writer: BagWriter) -> None:
    numbers = [writer.add_connection(topic, header(topic)) for topic in ("/a", "/b")]
    for time in range(MESSAGES):
        writer.write(numbers[time % 2], time, b"x" * 50)
    writer.close()


@given(
    st.lists(
        st.tuples(
            st.integers(0, 3),
            st.integers(0, 5 * SECOND),
            st.one_of(st.binary(max_size=40), st.just(b"x" * 70_000)),
        ),
        max_size=30,
    ),
    st.integers(0, 200_000),
    st.sampled_from(COMPRESSIONS),
)
def test_any_messages_come_back(
    messages: list[tuple[int, int, bytes]], threshold: int, compression: str
) -> None:
    stream = io.BytesIO()
    writer = BagWriter(stream, chunk_threshold=threshold, compression=compression)
    numbers = [writer.add_connection(f"/t{i}", header(f"/t{i}")) for i in range(4)]
    for i, time, body in messages:
        cut = len(body) // 2
        writer.write(numbers[i], time, memoryview(body)[:cut], body[cut:])
    assert writer.size >= len(stream.getvalue())
    writer.close()

    bag = Parsed(stream.getvalue())
    assert bag.messages == messages
    assert sum(len(index.entries) for index in bag.indexes) == len(messages)
    for index in bag.indexes:
        assert index.entries == sorted(index.entries)
    for number in numbers:
        assert sum(chunk.counts.get(number, 0) for chunk in bag.chunks) == sum(
            number == one for one, _, _ in messages
        )
    assert writer.chunks == bag.chunks


@pytest.mark.parametrize("compression", [each for each in COMPRESSIONS if each != NONE])
def test_size_is_that_after_compression(compression: str) -> None:
    stream = io.BytesIO()
    writer = BagWriter(stream, chunk_threshold=100_000, compression=compression)
    number = writer.add_connection("/t", header("/t"))
    for i in range(95):
        writer.write(number, i, b"x" * 10_000)
        assert len(stream.getvalue()) <= writer.size < 20_000


def test_chunk_that_has_been_compressed_is_written_without_another_message() -> None:
    stream = io.BytesIO()
    with ThreadPoolExecutor(1) as executor:
        writer = BagWriter(
            stream, chunk_threshold=0, compression=BZ2, executor=executor, max_waiting=sys.maxsize
        )
        writer.write(writer.add_connection("/t", header("/t")), 1, b"x" * 1000)
    writer.write_ready()
    assert writer.gathered == 0
    assert b"BZh9" in stream.getvalue()
