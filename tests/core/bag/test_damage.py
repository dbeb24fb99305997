"""Damaged bags yield a one-line error or messages that were in the bag; never other messages, a hang or a crash."""

from __future__ import annotations

import io
import random
import struct
from collections.abc import Callable
from typing import TypeVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from minirospy.base.errors import BagError, BagFormatError, BagUnindexedError
from minirospy.core.bag import info
from minirospy.core.bag import reader as reading
from minirospy.core.bag.chunks import StoredChunk
from minirospy.core.bag.compression import COMPRESSIONS
from minirospy.core.bag.encoding import encode_bag_header, encode_chunk_info, encode_connection
from minirospy.core.bag.reader import ChunkedReader, open_bag
from minirospy.core.bag.records import MAGIC, BagHeader, parse_records
from minirospy.core.bag.repair import Repair
from minirospy.core.bag.writer import BagWriter, Continued
from tests.core.bag.bags import Given, connection, make_bag

Found = tuple[int, int, bytes]
_T = TypeVar("_T")


def chunks(count: int = 12) -> list[list[Given]]:
    """Return chunks of messages whose bytes are all different."""
    source = random.Random(7)
    return [
        [Given(number % 3, chunk * 100 + number, source.randbytes(30)) for number in range(20)]
        for chunk in range(count)
    ]


def is_one_line(error: BagError) -> bool:
    return bool(str(error)) and "\n" not in str(error)


def read(data: bytes) -> list[Found]:
    """Return the messages before the first error; raise the error if the bag cannot be opened."""
    reader = open_bag(io.BytesIO(data))
    found: list[Found] = []
    try:
        found.extend((each.connection.id, each.time, each.body) for each in reader.messages())
    except BagError as error:
        return found if is_one_line(error) else [(-1, -1, b"")]
    finally:
        reader.close()
    return found


def repaired(data: bytes) -> list[Found]:
    """Return the messages in a bag after `rosbag reindex`."""
    stream = io.BytesIO(data)
    repair = Repair(stream)
    positions = list(repair.run())
    assert len(positions) == len(set(positions))
    repair.apply()
    BagWriter(stream, continued=Continued(repair.connections.values(), repair.chunks, repair.end)).close()
    return read(stream.getvalue())


def boundaries(data: bytes) -> list[int]:
    """Return the positions at which the records in a bag end."""
    return [13, *(record.end + 13 for record in parse_records(data[13:]))]


def attempt(action: Callable[[bytes], _T], data: bytes) -> _T | None:
    """Return the result of an action on a bag, or None if it raises an error with a one-line message."""
    try:
        return action(data)
    except BagError as error:
        if is_one_line(error):
            return None
        raise


GIVEN = chunks()
EVERY = {tuple(each) for chunk in GIVEN for each in chunk}


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("shift", [-1, 0, 1])
def test_bag_that_is_cut_off_anywhere_is_unindexed_and_repaired(compression: str, shift: int) -> None:
    data = make_bag(GIVEN, compression=compression)
    last = 0
    for end in (each + shift for each in boundaries(data)):
        if end >= len(data):
            continue
        cut = data[:end]
        with pytest.raises(BagError) as refused:
            read(cut)
        assert isinstance(refused.value, BagUnindexedError) or end < 13
        if end < 13:
            continue

        found = repaired(cut)
        assert set(found) <= EVERY
        assert last <= len(found) == len(set(found))
        last = len(found)
    assert last == len(EVERY)


def test_uncompressed_bag_that_is_cut_off_keeps_every_whole_message() -> None:
    data = make_bag(GIVEN)
    ends = [data.index(each.body) + len(each.body) for chunk in GIVEN for each in chunk]
    for end in range(4117, 9000, 7):
        assert len(repaired(data[:end])) == sum(each <= end for each in ends)


@pytest.mark.parametrize("compression", COMPRESSIONS[1:])
@pytest.mark.parametrize("part", ["start", "end"])
def test_flipped_byte_never_gives_another_message(
    compression: str, part: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = make_bag(GIVEN[:2], compression=compression)
    expected = {tuple(each) for chunk in GIVEN[:2] for each in chunk}
    # The header's record is padded to 4,096 bytes with spaces, which have no meaning.
    spaces = data.index(b" " * 100)
    start = [*range(spaces), *range(spaces, 4096, 64)]
    places = start if part == "start" else range(max(len(data) - 4096, 4096), len(data))

    # Otherwise, the threads that decompress in advance would be started ten thousand times.
    monkeypatch.setattr(reading, "THREADS", 0)
    for at in places:
        damaged = data[:at] + bytes((data[at] ^ 0xFF,)) + data[at + 1 :]
        assert set(attempt(read, damaged) or ()) <= expected, at
        if at % 16 == 0 or at < 100:
            assert set(attempt(repaired, damaged) or ()) <= expected, at


def test_flipped_byte_of_the_index_loses_no_message_without_an_error() -> None:
    data = make_bag(GIVEN[:4], compression="lz4")
    reader = open_bag(io.BytesIO(data))
    assert isinstance(reader, ChunkedReader)
    silent = []
    for at in range(reader.index_position, len(data)):
        for flip in (0x01, 0xFF):
            damaged = data[:at] + bytes((data[at] ^ flip,)) + data[at + 1 :]
            try:
                opened = open_bag(io.BytesIO(damaged))
                if len(list(opened.messages())) != 80:
                    silent.append(at)
            except BagError:
                continue
    assert silent == []


@pytest.mark.parametrize("size", [30, 100_000])
@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_topic_or_type_that_is_damaged_in_the_index_is_refused(compression: str, size: int) -> None:
    given = [
        [Given(number % 3, chunk * 100 + number, bytes(size)) for number in range(9)] for chunk in range(3)
    ]
    data = make_bag(given, compression=compression)
    assert len(read(data)) == 27
    reader = open_bag(io.BytesIO(data))
    assert isinstance(reader, ChunkedReader)
    for text in (b"topic=/topic1", b"type=std_msgs/String", b"md5sum=992c", b"message_definition=string"):
        at = data.index(text, data.index(b"topic=/topic1", reader.index_position)) + len(text) - 1
        damaged = data[:at] + bytes((data[at] ^ 1,)) + data[at + 1 :]
        with pytest.raises(
            BagFormatError, match=r"connection 1 is /topic1 .* in its chunk, and .* in the index"
        ):
            list(open_bag(io.BytesIO(damaged)).messages([1]))


def test_damaged_chunk_costs_its_own_messages_alone() -> None:
    data = make_bag(GIVEN, compression="lz4")
    reader = open_bag(io.BytesIO(data))
    position = reader.chunk_headers()[reader.chunks[3].position].data_position + 50
    damaged = data[:position] + bytes((data[position] ^ 0xFF,)) + data[position + 1 :]

    assert len(read(damaged)) == 60
    found = repaired(damaged)
    assert len(found) == len(EVERY) - 20
    assert set(found) == EVERY - {tuple(each) for each in GIVEN[3]}


def chunk_places(data: bytes) -> list[tuple[int, int, int]]:
    """Return each chunk's position, its data's start, and its end after the index records."""
    reader = open_bag(io.BytesIO(data))
    assert isinstance(reader, ChunkedReader)
    headers = reader.chunk_headers()
    starts = [chunk.position for chunk in reader.chunks]
    return [
        (start, headers[start].data_position, end)
        for start, end in zip(starts, [*starts[1:], reader.index_position], strict=True)
    ]


def spoilt(data: bytes, kind: str) -> bytes:
    """Return a bag with a damaged fourth chunk, after which the records are no longer consecutive."""
    start, body, end = chunk_places(data)[3]
    lengths = {
        "header length": (start, start + 4, b"\xff" * 4),
        "data length": (body - 4, body, b"\xff\xff\xff\x7f"),
        "zeros": (start, end, bytes(end - start)),
        "missing bytes": (body + 20, body + 120, b""),
        "more bytes": (body + 20, body + 20, bytes(70)),
        "index": (end - 30, end, bytes(30)),
        "index length": (end - 40, end, b""),
    }
    first, last, replaced = lengths[kind]
    return data[:first] + replaced + data[last:]


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize(
    ("kind", "lost"),
    [
        ("header length", 20),
        ("data length", 20),
        ("zeros", 20),
        ("missing bytes", 20),
        ("more bytes", 20),
        ("index", 0),
        ("index length", 0),
    ],
)
def test_repair_goes_on_at_the_next_chunk(compression: str, kind: str, lost: int) -> None:
    data = spoilt(make_bag(GIVEN, compression=compression), kind)
    repair = Repair(stream := io.BytesIO(data))
    list(repair.run())
    repair.apply()
    BagWriter(stream, continued=Continued(repair.connections.values(), repair.chunks, repair.end)).close()
    found = read(stream.getvalue())

    if compression == "none" and kind == "data length":
        lost = 0  # its index records show where the chunk's data ends
    assert set(found) <= EVERY
    assert len(found) == len(EVERY) - lost
    assert [line.startswith("chunk at byte") for line in repair.problems] == ([True, False] if lost else [])
    if lost:
        assert repair.problems[-1] == "20 of 240 messages are lost"
    stream.seek(0)
    assert sum(map(len, open_bag(stream).index([0, 1, 2]))) == len(found)
    assert repaired(stream.getvalue()) == found


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("place", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", ["missing byte", "wrong byte"])
def test_repair_writes_a_wrong_offset_of_the_index_again(compression: str, place: int, kind: str) -> None:
    """The last four bytes of a chunk's index records are an offset, so the times and the length are right."""
    bag = make_bag(GIVEN, compression=compression)
    at = chunk_places(bag)[3][2] - place
    damaged = bag[:at] + (bytes((bag[at] ^ 0xFF,)) if kind == "wrong byte" else b"") + bag[at + 1 :]

    repair = Repair(stream := io.BytesIO(damaged))
    list(repair.run())
    assert repair.problems == []
    repair.apply()
    BagWriter(stream, continued=Continued(repair.connections.values(), repair.chunks, repair.end)).close()
    assert stream.getvalue() == bag


def test_chunk_with_a_wrong_length_and_a_wrong_offset_is_repaired() -> None:
    bag = make_bag(GIVEN)
    damaged = bytearray(spoilt(bag, "data length"))
    damaged[chunk_places(bag)[3][2] - 4] ^= 0xFF
    assert set(repaired(bytes(damaged))) == EVERY


@given(st.data(), st.sampled_from(COMPRESSIONS[1:]))
@settings(deadline=None, max_examples=60)
def test_damage_costs_only_the_chunks_that_it_touches(data: st.DataObject, compression: str) -> None:
    bag = make_bag(GIVEN, compression=compression)
    places = chunk_places(bag)
    start = data.draw(st.integers(places[0][0], places[-1][2] - 1))
    end = min(start + data.draw(st.integers(1, 3000)), places[-1][2])
    damaged = bag[:start] + data.draw(st.binary(max_size=100)) + bag[end:]

    found = set(repaired(damaged))
    assert found <= EVERY
    for chunk, (first, _, last) in zip(GIVEN, places, strict=True):
        if last <= start or first >= end:
            assert {tuple(each) for each in chunk} <= found


@given(st.binary(max_size=300), st.sampled_from([b"", b"#ROSBAG V2.0\n", b"#ROSBAG V1.2\n"]))
def test_any_bytes_are_refused_or_empty(noise: bytes, magic: bytes) -> None:
    assert not attempt(read, magic + noise)


@given(st.data())
@settings(deadline=None, max_examples=100)
def test_damage_of_any_kind_is_survived(data: st.DataObject) -> None:
    bag = bytearray(make_bag(GIVEN[:4], compression=data.draw(st.sampled_from(COMPRESSIONS))))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(bag) - 1))
        bag[at : at + data.draw(st.integers(0, 20))] = data.draw(st.binary(max_size=20))

    attempt(read, bytes(bag))
    attempt(repaired, bytes(bag))
    attempt(described, bytes(bag))


def described(data: bytes) -> str:
    """Return the info about a bag, after reading its complete index."""
    reader = open_bag(io.BytesIO(data))
    summary = info.summarize(reader, "a.bag", frequencies=True)
    return info.as_text(summary) + info.as_yaml(summary)


def test_zeros_are_not_a_bag() -> None:
    for size in (1, 13, 5000):
        with pytest.raises(BagFormatError):
            read(bytes(size))


def test_chunk_of_a_killed_writer_is_repaired() -> None:
    """Python's and C++'s writers complete a chunk's header when the chunk is full."""
    data = make_bag(GIVEN[:3], closed=False)
    reader = open_bag(io.BytesIO(make_bag(GIVEN[:3])))
    stored: StoredChunk = reader.chunk_headers()[reader.chunks[2].position]
    position = reader.chunks[2].position
    head = data[position : stored.data_position].replace(stored.chunk.size.to_bytes(4, "little"), bytes(4))
    killed = data[:position] + head + data[stored.data_position : stored.end - 10]

    assert len(repaired(killed)) == 59


def test_repair_without_writing_reads_the_last_chunk() -> None:
    data = make_bag(GIVEN[:3], closed=False)[:-500]
    stream = io.BytesIO(data)
    repair = Repair(stream)
    list(repair.run())
    reader = ChunkedReader(stream, repair.connections, repair.chunks, headers=repair.headers)

    assert len(list(reader.messages())) == len(repaired(data)) > 40
    assert stream.getvalue() == data


def test_definitions_of_hostile_bags_are_not_executed() -> None:
    from minirospy.introspect.bags import class_of

    hostile = connection(0, type="a/B", message_definition='string x\n"""\nimport os; os.abort()\n"""\n')
    lines: list[str] = []
    assert class_of(hostile.type, "0", hostile.definition, lines.append).__slots__ == []
    assert "has invalid message definition" in lines[0]


def test_index_that_names_a_chunk_many_times_is_damaged() -> None:
    # Messages with the same time, connection and position used to be compared by values that have no order.
    data = make_bag([[Given(0, 5, b"\1\0\0\0a"), Given(1, 5, b"\1\0\0\0b")]])
    reader = open_bag(io.BytesIO(data))
    (chunk,) = reader.chunks
    index = reader.index_position  # type: ignore[attr-defined]
    connections = b"".join(map(encode_connection, reader.connections.values()))
    header = encode_bag_header(BagHeader(index, 2, 3_000))
    damaged = data[: len(MAGIC)] + header + data[len(MAGIC) + len(header) : index]
    damaged += connections + encode_chunk_info(chunk) * 3_000

    with pytest.raises(BagUnindexedError) as raised:
        open_bag(io.BytesIO(damaged))
    assert raised.value.why.startswith("the index names a chunk twice")
    assert repaired(damaged) == read(data)
    # A reader of a bag that is still being written gets its chunks from the caller.
    twice = ChunkedReader(io.BytesIO(data), reader.connections, [chunk] * 3)
    assert sorted(each.body for each in twice.messages()) == sorted([b"\1\0\0\0a", b"\1\0\0\0b"] * 3)


@pytest.mark.parametrize("closed", [True, False])
def test_time_that_no_index_holds_costs_its_chunk_alone(closed: bool) -> None:
    # A time of 32-bit seconds and nanoseconds may leave the 32-bit range once its nanoseconds are normalized below a
    # billion.
    last = (2**32 - 1) * 10**9 + 999_999_999
    data = make_bag([[Given(0, last, b"\1\0\0\0a")], [Given(0, 5, b"\1\0\0\0b")]], closed=closed)
    stamp = struct.pack("<II", 2**32 - 1, 999_999_999)
    data = data.replace(stamp, b"\xff" * 8)
    assert [body for _, _, body in repaired(data)] == [b"\1\0\0\0b"]
