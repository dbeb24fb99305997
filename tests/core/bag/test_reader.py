"""core/bag/reader: messages in time order from any arrangement of chunks, compared with sorting all messages."""

from __future__ import annotations

import io
import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag1 import Reader as Oracle

from minirospy.base.errors import BagFormatError, BagUnindexedError, BagVersionError
from minirospy.core.bag import chunks as reading_chunks
from minirospy.core.bag import info
from minirospy.core.bag import reader as reading
from minirospy.core.bag.base import BagReader, StoredMessage
from minirospy.core.bag.compression import COMPRESSIONS
from minirospy.core.bag.reader import ChunkedReader, open_bag
from minirospy.core.bag.records import MAGIC
from tests.core.bag.bags import Given, connection, make_bag

messages = st.builds(
    Given,
    st.integers(0, 2),
    st.one_of(st.integers(0, 5), st.integers(0, (1 << 32) * 10**9 - 1)),
    st.binary(max_size=20),
)
bags = st.lists(st.lists(messages, min_size=1, max_size=8), max_size=6)


def opened(data: bytes) -> BagReader:
    return open_bag(io.BytesIO(data))


class Counting(io.BytesIO):
    """A stream that counts the bytes read from it."""

    count = 0

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        self.count += len(data)
        return data


def plain(stored: StoredMessage) -> Given:
    return Given(stored.connection.id, stored.time, stored.body)


def in_order(chunks: list[list[Given]], reader: BagReader) -> list[Given]:
    """Sort as rosbag does: by time, then by the order of the connections, then by position."""
    rank = {number: at for at, number in enumerate(reader.connections)}
    return sorted(
        (each for chunk in chunks for each in chunk), key=lambda each: (each.time, rank[each.connection])
    )


@given(bags, st.sampled_from(COMPRESSIONS), st.integers(0, 1))
@settings(deadline=None)
def test_messages_come_in_the_order_of_time(chunks: list[list[Given]], compression: str, layout: int) -> None:
    reader = opened(make_bag(chunks, compression=compression, layout=layout))

    assert list(map(plain, reader.messages())) == in_order(chunks, reader)
    reader.close()


@given(bags, st.sets(st.integers(0, 2)), st.integers(0, 6), st.integers(0, 6))
@settings(deadline=None)
def test_messages_are_filtered(chunks: list[list[Given]], wanted: set[int], start: int, end: int) -> None:
    reader = opened(make_bag(chunks))
    numbers = [number for number in reader.connections if number in wanted]

    expected = [
        each for each in in_order(chunks, reader) if each.connection in wanted and start <= each.time <= end
    ]
    assert list(map(plain, reader.messages(numbers, start, end))) == expected


@given(bags)
@settings(deadline=None)
def test_every_message_is_found_again_by_position_and_by_index(chunks: list[list[Given]]) -> None:
    reader = opened(make_bag(chunks))
    found = list(reader.messages())

    assert [reader.message_at(each.position) for each in found] == found
    for number, index in zip(reader.connections, reader.index(reader.connections), strict=True):
        of_it = [each for each in found if each.connection.id == number]
        assert [(entry.time, (entry.chunk, entry.offset)) for entry in index] == [
            (each.time, each.position) for each in of_it
        ]


@given(bags, st.sets(st.integers(0, 2)), st.integers(0, 1))
@settings(deadline=None)
def test_few_messages_are_picked_as_they_are_scanned(
    chunks: list[list[Given]], wanted: set[int], layout: int
) -> None:
    data = make_bag(chunks, layout=layout)
    with pytest.MonkeyPatch.context() as patch:
        scanned = opened(data)
        numbers = [number for number in scanned.connections if number in wanted]
        expected = list(scanned.messages(numbers, 1, 4))
        patch.setattr(reading_chunks, "PICK_SIZE", 0)
        picking = opened(data)
        assert list(picking.messages(numbers, 1, 4)) == expected


def test_few_messages_of_a_large_bag_are_read_alone() -> None:
    stream = Counting(
        make_bag(
            [
                [Given(each % 2, 9 * chunk + each, bytes(10**6 * (each % 2))) for each in range(8)]
                for chunk in range(4)
            ]
        )
    )
    reader = open_bag(stream)
    assert len(list(reader.messages([0]))) == 16
    assert stream.count < 30_000


@pytest.mark.parametrize("place", ["time", "offset", "count"])
def test_damaged_index_is_not_believed(place: str) -> None:
    data = make_bag([[Given(each % 2, each, bytes(10**6 * (each % 2))) for each in range(8)]])
    index = data.index(b"\x04\0\0\0op=\x04", data.index(b"op=\x05"))
    at = index + {"time": 47, "offset": 55, "count": 41}[place]
    damaged = data[:at] + bytes((data[at] ^ 1,)) + data[at + 1 :]

    assert len(list(opened(damaged).messages([0]))) == 4


def test_overlapping_chunks_need_no_more_memory_than_the_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "CACHE_SIZE", 1)
    chunks = [
        [Given(number % 3, time, b"%d" % time) for time in range(number, 200, 9)] for number in range(9)
    ]
    reader = opened(make_bag(chunks))

    assert [each.time for each in reader.messages()] == list(range(200))


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_rosbags_reads_the_same(tmp_path: Path, compression: str) -> None:
    shuffled = random.Random(1)
    chunks = [
        [Given(shuffled.randrange(3), shuffled.randrange(10**18), shuffled.randbytes(30)) for _ in range(50)]
        for _ in range(20)
    ]
    path = tmp_path / "a.bag"
    path.write_bytes(make_bag(chunks, compression=compression))

    with Oracle(path) as oracle, path.open("rb") as stream:
        expected = [(each.topic, time, bytes(body)) for each, time, body in oracle.messages()]
        reader = open_bag(stream)
        assert [(each.connection.topic, each.time, each.body) for each in reader.messages()] == expected
        reader.close()


def test_opening_reads_neither_chunks_nor_indexes() -> None:
    stream = Counting(make_bag([[Given(0, time, bytes(10_000))] for time in range(100)]))
    open_bag(stream)
    assert stream.count < 20_000


def test_reader_shows_messages_written_meanwhile() -> None:
    data = make_bag([[Given(0, 1, b"a")], [Given(0, 2, b"b")]])
    whole = opened(data)
    chunks = list(whole.chunks[:1])
    growing = ChunkedReader(io.BytesIO(data), whole.connections, chunks)

    assert [each.body for each in growing.messages()] == [b"a"]
    assert len(growing.index([0])[0]) == 1
    chunks.append(whole.chunks[1])
    assert [each.body for each in growing.messages()] == [b"a", b"b"]
    assert len(growing.index([0])[0]) == 2


def test_message_of_an_unknown_connection_is_damage() -> None:
    data = make_bag([[Given(0, 1, b"a"), Given(1, 2, b"b")]])
    whole = opened(data)
    reader = ChunkedReader(io.BytesIO(data), {0: whole.connections[0]}, whole.chunks)

    with pytest.raises(BagFormatError, match="a message's connection 1 is not in the bag"):
        list(reader.messages())


def test_bag_that_was_not_closed_is_unindexed() -> None:
    with pytest.raises(BagUnindexedError, match="Unindexed bag"):
        opened(make_bag([[Given(0, 1, b"a")]], closed=False))


@pytest.mark.parametrize(
    ("version", "what"),
    [
        ("1.1", "unsupported bag version 101. Please convert bag to newer format."),
        ("3.0", "unknown bag version 300"),
    ],
)
def test_other_versions_are_refused(version: str, what: str) -> None:
    with pytest.raises(BagVersionError) as refused:
        opened(MAGIC.replace(b"2.0", version.encode()) + bytes(100))
    assert str(refused.value) == what


def test_two_types_and_two_publishers_on_a_topic_stay_apart() -> None:
    given_connections = [
        connection(0, "/chatter", callerid="/a"),
        connection(1, "/chatter", callerid="/b"),
        connection(2, "/chatter", type="std_msgs/Int32", md5sum="1", message_definition="int32 data"),
    ]
    reader = opened(make_bag([[Given(number, number, b"") for number in range(3)]], given_connections))

    assert [each.connection for each in reader.messages()] == given_connections


def test_rates_of_numpy_are_those_of_python(monkeypatch: pytest.MonkeyPatch) -> None:
    shuffled = random.Random(3)
    for count in (2, 3, 10, 1001):
        chunks = [
            [Given(each % 2, shuffled.randrange(10**13), b"") for each in range(count)] for _ in range(2)
        ]
        names = [connection(0, "/a"), connection(1, "/a")]
        texts = set()
        for limit, block in ((10**9, 10), (1, 7), (1, 1 << 16)):
            monkeypatch.setattr(info, "NUMPY_PAYS", limit)
            monkeypatch.setattr(info, "BLOCK", block)
            texts.add(info.as_yaml(info.summarize(opened(make_bag(chunks, names)), "a", frequencies=True)))
        assert len(texts) == 1
        assert "frequency:" in texts.pop()
