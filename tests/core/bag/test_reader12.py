"""core/bag/reader12: bags of version 1.2, with and without an index."""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence

import pytest

from minirospy.base.errors import BagError, BagFormatError, BagUnindexedError
from minirospy.core.bag.encoding import encode_fields
from minirospy.core.bag.reader import open_bag
from minirospy.core.bag.reader12 import unindexed_bag12
from tests.core.bag.bags import STRING, STRING_MD5

MESSAGES = [("/a", 30, b"3"), ("/b", 10, b"1"), ("/a", 20, b"2")]


def record(data: bytes, **fields: bytes) -> bytes:
    return encode_fields(fields) + struct.pack("<I", len(data)) + data


def make_bag12(messages: Sequence[tuple[str, int, bytes]], *, indexed: bool = True) -> bytes:
    """Return a bag with (topic, time, body); the definition is stored before the first message on the first topic."""
    bag = b"#ROSBAG V1.2\n"
    header = record(b" " * 100, op=b"\x03", index_pos=bytes(8))
    if indexed:
        bag += header
    entries: dict[str, list[tuple[int, int]]] = {}
    for topic, time, body in messages:
        entries.setdefault(topic, []).append((time, len(bag)))
        name = topic.encode()
        if len(entries[topic]) == 1 and (indexed or len(entries) == 1):
            bag += record(
                b"",
                op=b"\x01",
                topic=name,
                type=b"std_msgs/String",
                md5=STRING_MD5.encode(),
                **{"def": STRING.encode()},
            )
        stamp = {"sec": struct.pack("<I", time // 10**9), "nsec": struct.pack("<I", time % 10**9)}
        bag += record(body, op=b"\x02", topic=name, md5=STRING_MD5.encode(), type=b"std_msgs/String", **stamp)
    if not indexed:
        return bag

    position = len(bag)
    for topic, found in entries.items():
        data = b"".join(struct.pack("<IIQ", time // 10**9, time % 10**9, at) for time, at in found)
        count = struct.pack("<I", len(found))
        bag += record(
            data, op=b"\x04", topic=topic.encode(), type=b"std_msgs/String", ver=bytes(4), count=count
        )
    return bag.replace(header, record(b" " * 100, op=b"\x03", index_pos=struct.pack("<Q", position)), 1)


@pytest.mark.parametrize("indexed", [True, False])
def test_messages_come_in_the_order_of_time(indexed: bool) -> None:
    reader = open_bag(io.BytesIO(make_bag12(MESSAGES, indexed=indexed)))
    found = list(reader.messages())

    assert [(each.connection.topic, each.time, each.body) for each in found] == sorted(
        MESSAGES, key=lambda each: each[1]
    )
    assert [reader.message_at(each.position) for each in found] == found
    assert [each.md5sum for each in reader.connections.values()] == [STRING_MD5] * 2


def test_messages_are_filtered() -> None:
    reader = open_bag(io.BytesIO(make_bag12(MESSAGES)))
    (a,) = [number for number, each in reader.connections.items() if each.topic == "/a"]

    assert [each.body for each in reader.messages([a])] == [b"2", b"3"]
    assert [each.body for each in reader.messages(start=20, end=20)] == [b"2"]
    assert [len(index) for index in reader.index([a])] == [2]


def test_bag_that_was_not_closed_is_unindexed_and_scanned() -> None:
    data = make_bag12(MESSAGES)
    last_index = data.rindex(b"op=\x04") - 8  # at a record's boundary, a missing record cannot be detected
    for end in set(range(data.rindex(b"op=\x02") + 60, len(data))) - {last_index}:
        stream = io.BytesIO(data[:end])
        with pytest.raises(BagUnindexedError):
            open_bag(stream)
        stream.seek(0)
        reader = unindexed_bag12(stream)
        assert [each.body for each in reader.messages()] in ([b"1", b"2", b"3"], [b"1", b"3"])


def test_message_without_a_definition_ends_the_scan() -> None:
    data = make_bag12(MESSAGES, indexed=False)
    reader = open_bag(io.BytesIO(data[:13] + data[data.index(b"\x04\0\0\0op=\x02") - 4 :]))

    assert list(reader.messages()) == []
    with pytest.raises(BagFormatError):
        reader.message_at(5)


def fault(data: bytes) -> str:
    """Read a damaged bag; return the error, or "" if it could be read."""
    try:
        reader = open_bag(io.BytesIO(data))
        reader.prepare()
        list(reader.messages())
    except BagError as error:
        return str(error) or "no text"
    return ""


@pytest.mark.parametrize("indexed", [True, False])
def test_flipped_byte_is_refused_in_one_line_or_read(indexed: bool) -> None:
    data = make_bag12(MESSAGES, indexed=indexed)
    for at in range(len(data)):
        for flip in (0x01, 0xFF):
            assert "\n" not in fault(data[:at] + bytes((data[at] ^ flip,)) + data[at + 1 :])


def test_bag_that_is_cut_off_is_refused_in_one_line_or_read() -> None:
    data = make_bag12(MESSAGES)
    assert all("\n" not in fault(data[:end]) for end in range(len(data)))
