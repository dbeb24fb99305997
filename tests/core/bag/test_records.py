"""core/bag/records: golden bytes of the format, round trips, and one-line errors for damaged data."""

from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import BagEncryptedError, BagFormatError
from minirospy.core.bag.encoding import (
    encode_bag_header,
    encode_chunk_header,
    encode_chunk_info,
    encode_connection,
    encode_fields,
    encode_index_data,
    message_prefixes,
)
from minirospy.core.bag.records import (
    MAGIC,
    MAX_UINT32,
    BagHeader,
    Chunk,
    ChunkInfo,
    Connection,
    Fields,
    parse_bag_header,
    parse_chunk_header,
    parse_chunk_info,
    parse_connection,
    parse_fields,
    parse_message_data,
    parse_record,
    parse_records,
    read_record,
    read_version,
)
from tests.core.bag.bags import parse_index

CHATTER = {
    "topic": b"/chatter",
    "type": b"std_msgs/String",
    "md5sum": b"abc",
    "message_definition": b"string data\n",
}

uint32 = st.integers(0, MAX_UINT32)
uint64 = st.integers(0, (1 << 64) - 1)
times = st.integers(0, MAX_UINT32 * 10**9)
names = st.text(st.characters(exclude_characters="=", exclude_categories=("Cs",)), max_size=20)
fields = st.dictionaries(names, st.binary(max_size=40), max_size=8)


def test_message_prefix_has_the_bytes_of_rosbag() -> None:
    assert message_prefixes(1)[0] == (b"\x26\0\0\0\x04\0\0\0op=\x02\x09\0\0\0conn=\x01\0\0\0\x0d\0\0\0time=")


def test_bag_header_has_a_constant_size() -> None:
    empty, full = (
        encode_bag_header(header) for header in (BagHeader(0, 0, 0), BagHeader(1 << 40, 12, MAX_UINT32))
    )

    assert len(empty) == len(full) == 4104  # the first chunk of every bag is at byte 4117
    assert empty.endswith(b"    ")


@pytest.mark.parametrize("layout", [0, 1], ids=["python", "cpp"])
def test_message_prefix_starts_the_record(layout: int) -> None:
    prefix = message_prefixes(7)[layout]
    record = parse_record(prefix + b"\0\0\0\0\x05\0\0\0\x03\0\0\0abc", 0)

    assert len(prefix) == 34
    assert parse_message_data(record, b"abc") == (7, 5, b"abc")
    assert record.data_position == 46


@given(fields)
def test_fields_return_as_they_were_written(given_fields: Fields) -> None:
    assert parse_fields(encode_fields(given_fields)[4:]) == given_fields


@given(st.binary(max_size=60))
def test_any_bytes_are_fields_or_refused(data: bytes) -> None:
    try:
        parse_fields(data)
    except BagFormatError:
        return


@given(st.binary(max_size=80))
def test_any_bytes_are_records_or_refused(data: bytes) -> None:
    try:
        for record in parse_records(data):
            assert record.end <= len(data)
    except BagFormatError:
        return


@given(uint64, uint32, uint32)
def test_bag_header_returns(index_pos: int, connections: int, chunks: int) -> None:
    header = BagHeader(index_pos, connections, chunks)
    assert parse_bag_header(parse_record(encode_bag_header(header), 0)) == header


@given(uint32, names, fields)
def test_connection_returns(number: int, topic: str, others: Fields) -> None:
    connection = Connection(number, topic, others | CHATTER)
    data = encode_connection(connection)
    record = parse_record(data, 0)

    assert parse_connection(record, data[record.data_position : record.end]) == connection
    assert (connection.type, connection.md5sum, connection.definition) == (
        "std_msgs/String",
        "abc",
        "string data\n",
    )


@given(uint32, st.lists(st.tuples(times, uint32)))
def test_index_data_returns(number: int, entries: list[tuple[int, int]]) -> None:
    data = encode_index_data(number, entries)
    record = parse_record(data, 0)

    assert parse_index(record, data[record.data_position : record.end]) == (number, entries)


@given(uint64, times, times, st.dictionaries(uint32, uint32))
def test_chunk_info_returns(position: int, start: int, end: int, counts: dict[int, int]) -> None:
    info = ChunkInfo(position, start, end, counts)
    data = encode_chunk_info(info)
    record = parse_record(data, 0)

    assert parse_chunk_info(record, data[record.data_position : record.end]) == info


def test_chunk_header_returns() -> None:
    data = encode_chunk_header(Chunk("lz4", 9, 3)) + b"abc"

    assert parse_chunk_header(parse_record(data, 0)) == Chunk("lz4", 9, 3)


def test_latching_and_callerid_are_optional() -> None:
    plain, full = (
        Connection(0, "/chatter", header)
        for header in (CHATTER, CHATTER | {"latching": b"1", "callerid": b"/n"})
    )

    assert (plain.latching, plain.callerid) == (False, "")
    assert (full.latching, full.callerid) == (True, "/n")


@pytest.mark.parametrize("size", [4 << 30, 5 << 30])
def test_more_than_four_gigabytes_are_refused(size: int) -> None:
    with pytest.raises(BagFormatError, match=f"a chunk of {size} bytes is larger"):
        encode_chunk_header(Chunk("none", size, 1))


@pytest.mark.parametrize("missing", ["type", "md5sum", "message_definition"])
def test_connection_without_its_type_is_refused(missing: str) -> None:
    data = encode_connection(Connection(0, "/chatter", {k: v for k, v in CHATTER.items() if k != missing}))
    record = parse_record(data, 0)

    with pytest.raises(BagFormatError, match=f'expected "{missing}" field in record'):
        parse_connection(record, data[record.data_position :])


def test_encrypted_bag_is_refused_by_name() -> None:
    data = encode_fields({"op": b"\x03", "encryptor": b"rosbag/AesCbcEncryptor"}) + bytes(4)

    with pytest.raises(BagEncryptedError, match="AesCbcEncryptor") as refused:
        parse_bag_header(parse_record(data, 0))
    assert refused.value.encryptor == "rosbag/AesCbcEncryptor"


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"", "expecting 4 bytes, read 0 (at byte 0)"),
        (b"\xff\xff\xff\xff", "a record's header of 4294967295 bytes does not fit (at byte 0)"),
        (b"\x05\0\0\0abcde", "a record's header of 5 bytes does not fit (at byte 0)"),
        (encode_fields({"op": b"\x05"}), "a record's header of 8 bytes does not fit (at byte 0)"),
        (
            encode_fields({"op": b"\x05"}) + b"\x01\0\0\0",
            "a record's data of 1 bytes does not fit (at byte 0)",
        ),
        (
            encode_fields({"op": b"\x05\x05"}) + bytes(4),
            'error reading field "op": it has 2 bytes (at byte 0)',
        ),
        (encode_fields({"no": b"\x05"}) + bytes(4), 'expected "op" field in record (at byte 0)'),
    ],
)
def test_damaged_record_is_refused_with_its_place(data: bytes, what: str) -> None:
    with pytest.raises(BagFormatError) as refused:
        read_record(io.BytesIO(data), len(data))
    assert str(refused.value) == what
    assert refused.value.position == 0


@pytest.mark.parametrize(
    ("line", "version"),
    [(MAGIC, 200), (b"#ROSBAG V1.2\n", 102), (b"#ROSRECORD V1.1\n", 101), (b"#ROSBAG V3.4", 304)],
)
def test_version_is_read(line: bytes, version: int) -> None:
    assert read_version(io.BytesIO(line + b"rest")) == version


@pytest.mark.parametrize(
    "data", [b"#ROSBAG V20\n", b"\0" * 200, b"hello", b"#ROSBAG Vx.y\n", b"\xff V1.2", b"#ROSBAG"]
)
def test_other_files_are_refused(data: bytes) -> None:
    with pytest.raises(BagFormatError, match="This does not appear to be a bag file"):
        read_version(io.BytesIO(data))


def test_empty_file_is_refused() -> None:
    with pytest.raises(BagFormatError, match="empty file"):
        read_version(io.BytesIO(b""))
