"""core/wire/framing: frames in pieces of any size, compared with a slow, readable reference."""

from __future__ import annotations

import struct
from array import array

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import WireError
from minirospy.core.wire.framing import (
    CHUNK,
    MAX_FRAME,
    SPLIT,
    FrameReader,
    LargeFrame,
    Pieces,
    SplitFrame,
    check_split,
    may_split,
    parse_split,
    serialize_frame,
    split_frame,
)


def feed(reader: FrameReader, data: bytes, step: int) -> list[bytes]:
    """Feed ``data`` in pieces of at most ``step`` bytes, as a socket would."""
    frames = []
    at = 0
    while at < len(data):
        space = reader.space()
        count = min(step, len(space), len(data) - at)
        assert count > 0
        space[:count] = data[at : at + count]
        at += count
        frames += [bytes(frame) for frame in reader.received(count)]
    return frames


@given(st.lists(st.binary(max_size=200)), st.integers(1, 300))
def test_frames_come_out_whole_in_any_pieces(bodies: list[bytes], step: int) -> None:
    data = b"".join(serialize_frame(body) for body in bodies)
    assert feed(FrameReader(), data, step) == bodies


@pytest.mark.parametrize("size", [CHUNK - 5, CHUNK - 4, CHUNK - 3, CHUNK, CHUNK + 1, 5 * CHUNK])
@pytest.mark.parametrize("step", [1000, CHUNK, 1 << 30])
def test_sizes_around_the_buffer(size: int, step: int) -> None:
    bodies = [b"first", bytes(range(256)) * (size // 256) + b"x" * (size % 256), b"", b"last"]
    data = b"".join(serialize_frame(body) for body in bodies)
    assert feed(FrameReader(), data, step) == bodies


def test_a_large_frame_is_not_written_again() -> None:
    reader = FrameReader()
    big = b"a" * (2 * CHUNK)
    kept: list[memoryview] = []
    for data in (serialize_frame(big), serialize_frame(b"b" * (2 * CHUNK))):
        at = 0
        while at < len(data):
            space = reader.space()
            count = min(len(space), len(data) - at)
            space[:count] = data[at : at + count]
            at += count
            kept += reader.received(count)
    assert bytes(kept[0]) == big


def test_a_length_over_the_limit_is_refused() -> None:
    reader = FrameReader(limit=1 << 20)
    with pytest.raises(WireError, match="over the limit"):
        feed(reader, struct.pack("<I", (1 << 20) + 1), 4)


@pytest.mark.parametrize("step", [1, 7, 99, 1000, 100_000])
def test_a_frame_over_the_limit_is_left_out(step: int) -> None:
    reader = FrameReader(limit=3000, skips=True, chunk=1000)
    bodies = [b"a" * 10, b"b" * 3000, b"c" * 3001, b"d" * 5000, b"e" * 996, b"f" * 997, b""]
    data = b"".join(map(serialize_frame, bodies))
    assert feed(reader, data, step) == [bodies[0], bodies[1], *bodies[4:]]
    assert reader.skipped == 2


def test_a_frame_that_is_left_out_costs_no_memory() -> None:
    reader = FrameReader(limit=3000, skips=True, chunk=1000)
    feed(reader, struct.pack("<I", 1 << 31), 4)
    for _ in range(10):
        space = reader.space()
        assert len(space) == 1000
        assert list(reader.received(len(space))) == []


def test_a_claimed_length_costs_no_memory_before_the_bytes_come() -> None:
    reader = FrameReader()
    feed(reader, struct.pack("<I", 1 << 30), 4)
    assert len(reader.space()) == 16 * 1024 * 1024


def test_a_frame_beyond_the_first_claim_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.core.wire.framing.FIRST_CLAIM", 4 * CHUNK)
    body = bytes(range(256)) * (9 * CHUNK // 256)
    assert feed(FrameReader(), serialize_frame(body), 50_000) == [body]


# --- large messages, in pieces


def pieces(*written: bytes) -> Pieces:
    found = Pieces()
    for each in written:
        found.write(each)
    return found


@pytest.mark.parametrize("sizes", [[], [0], [3], [1, 2, 3], [CHUNK - 1], [CHUNK // 2, CHUNK // 2 - 1]])
def test_small_message_is_one_frame(sizes: list[int]) -> None:
    body = [bytes([number + 65]) * size for number, size in enumerate(sizes)]
    assert pieces(*body).frame() == serialize_frame(b"".join(body))


def test_length_of_an_array_is_that_of_its_bytes() -> None:
    """The len() of an array of numbers is not in bytes, whether it is alone or joined with other buffers."""
    numbers = memoryview(array("I", [1, 2, 3]))
    for written in ([numbers], [b"ab", numbers]):
        assert pieces(*written).frame() == serialize_frame(b"".join(map(bytes, written)))


def test_large_pieces_are_not_joined() -> None:
    large, other = b"L" * CHUNK, b"M" * (CHUNK + 5)
    frame = pieces(b"a", b"b", large, other, b"c", b"d").frame()
    assert isinstance(frame, LargeFrame)
    assert frame == ((b"ab", large, other, b"cd"), 2 * CHUNK + 9, 0)
    assert frame.pieces[1] is large
    assert pieces(large).frame() == ((large,), CHUNK, 0)
    assert pieces(b"a", large).frame() == ((b"a", large), CHUNK + 1, 0)


def test_large_piece_that_can_change_is_copied() -> None:
    changing = bytearray(b"x" * CHUNK)
    frame = pieces(changing).frame()
    assert isinstance(frame, LargeFrame)
    changing[0] = 0
    assert frame.pieces == (b"x" * CHUNK,)
    assert type(frame.pieces[0]) is bytes


def test_many_small_pieces_of_a_large_message_are_joined() -> None:
    frame = pieces(*[b"x" * 1000] * 100).frame()
    assert frame == ((b"x" * 100_000,), 100_000, 0)


def test_buffers_of_a_large_message() -> None:
    head, array = b"head" + CHUNK.to_bytes(4, "little"), b"t" * CHUNK
    for rest in [(), (b"rest",)]:
        size = CHUNK + 8 + sum(map(len, rest))
        length = struct.pack("<I", size)
        whole = LargeFrame((head, array, *rest), size)
        for split in (False, True):
            assert whole.buffers(split=split) == [length, head, array, *rest]
        frame = LargeFrame((head, array, *rest), size, CHUNK)
        assert frame.buffers(split=False) == [length, head, array, *rest]
        # The highest bit of the length is 1; the size of the array, and of what follows it, come next.
        lengths = struct.pack("<III", size + 0x80000000, CHUNK, sum(map(len, rest)))
        assert frame.buffers(split=True) == [lengths + head, array, *rest]


ARRAY = b"t" * CHUNK
LENGTH = CHUNK.to_bytes(4, "little")


@pytest.mark.parametrize(
    ("written", "after_array", "array"),
    [
        ([b"head", LENGTH, ARRAY], 0, CHUNK),
        ([LENGTH, ARRAY], 0, CHUNK),
        ([LENGTH, ARRAY, b"1"], 1, CHUNK),
        ([LENGTH, ARRAY, b"123"], 3, CHUNK),
        ([LENGTH, ARRAY, ARRAY], CHUNK, CHUNK),
        # The class does not end with a byte array, even if a number happens to equal the size of the next field.
        ([LENGTH, ARRAY], None, 0),
        # The last byte array is another one.
        ([LENGTH, ARRAY, b"\0\0\0\0"], 0, 0),
        ([LENGTH, ARRAY, LENGTH, ARRAY, b"1"], 1, 0),
        ([LENGTH, ARRAY, b"1"], 0, 0),
        ([ARRAY, b"1"], 1, 0),
        # The number before many small pieces happens to equal their size when joined.
        ([ARRAY[4:] + LENGTH, *([b"small"] * (CHUNK // 5)), b"x"], 0, 0),
        ([b"head", ARRAY], 0, 0),
    ],
)
def test_the_class_says_where_a_large_message_may_be_split(
    written: list[bytes], after_array: int | None, array: int
) -> None:
    frame = pieces(*written).frame(after_array)
    assert isinstance(frame, LargeFrame)
    assert frame.array == array
    assert frame.rest == (after_array if array else 0)
    assert b"".join(frame.pieces) == b"".join(written)


@pytest.mark.parametrize(
    ("head", "tail", "begins"),
    [
        (CHUNK.to_bytes(4, "little"), CHUNK, True),
        (b"x" + CHUNK.to_bytes(4, "little"), CHUNK, True),
        (CHUNK.to_bytes(4, "big"), CHUNK, False),
        ((CHUNK - 1).to_bytes(4, "little"), CHUNK - 1, False),
        ((CHUNK + 1).to_bytes(4, "little"), CHUNK, False),
        (b"\0\0\1", CHUNK, False),
        (b"", CHUNK, False),
    ],
)
def test_split_is_allowed_if_the_head_ends_with_the_array_length(
    head: bytes, tail: int, begins: bool
) -> None:
    assert may_split(head, tail) == begins


def test_split_sizes_of_a_frame() -> None:
    assert parse_split(struct.pack("<II", CHUNK, 7)) == (CHUNK, 7)
    assert check_split(CHUNK + 10, CHUNK, 0) == 10
    assert check_split(CHUNK + 4, CHUNK, 0) == 4
    assert check_split(CHUNK + 10, CHUNK, 6) == 4
    for size, length, rest in [
        (CHUNK + 3, CHUNK, 0),
        (CHUNK + 10, CHUNK - 1, 0),
        (10, CHUNK, 0),
        (CHUNK + 10, CHUNK, 7),
        (CHUNK + 10, CHUNK, 2**32 - 1),
    ]:
        words = (
            f"split message of {size} bytes says that it has an array of {length}, followed by {rest} bytes"
        )
        with pytest.raises(WireError, match=words):
            check_split(size, length, rest)


def test_split_frame_that_is_written_again_is_joined() -> None:
    frame = pieces(SplitFrame(LENGTH, ARRAY, b"rest")).frame()
    assert frame == ((LENGTH + ARRAY + b"rest",), CHUNK + 8, 0)


def test_split_frame_is_read_as_the_whole() -> None:
    head, array = b"0123456789", b"abcdefghij"
    for rest in (b"", b"xyz"):
        frame, whole = SplitFrame(head, array, rest), head + array + rest
        assert (len(frame), bytes(frame), frame.array, frame.rest) == (len(whole), whole, array, rest)
        for start in range(-1, 26):
            assert frame[start:] == whole[start:]
            for stop in range(-1, 26):
                assert frame[start:stop] == whole[start:stop]
                assert frame[start:stop:2] == whole[start:stop:2]
        for number in range(len(whole)):
            assert frame[number] == whole[number]
        # The array becomes the field without a copy.
        assert frame[10:20] is array
        assert frame[20:] == rest
    assert SplitFrame(head, array)[10:] is array


def test_frame_that_was_split_elsewhere_is_refused() -> None:
    frame = split_frame(LENGTH, ARRAY, b"rest")
    assert (frame.array, frame.rest, bytes(frame)) == (ARRAY, b"rest", LENGTH + ARRAY + b"rest")
    with pytest.raises(WireError, match="not split where its array begins"):
        split_frame(b"head", ARRAY, b"rest")


def test_limits_of_the_wire_are_as_documented() -> None:
    assert (CHUNK, MAX_FRAME, SPLIT) == (65536, 2**30, 2**31)


def test_large_frame_may_be_left_to_the_caller() -> None:
    reader = FrameReader(gathers=False)
    data = serialize_frame(b"small") + struct.pack("<I", 2 * CHUNK) + b"begin"
    assert feed(reader, data, 1 << 20) == [b"small"]
    assert reader.unfinished == (2 * CHUNK, b"begin")
    reader.unfinished = None
    assert feed(reader, serialize_frame(b"next"), 3) == [b"next"]
    assert reader.unfinished is None


def test_frame_that_just_fits_is_not_left_to_the_caller() -> None:
    reader = FrameReader(gathers=False)
    body = b"x" * (CHUNK - 4)
    assert feed(reader, serialize_frame(body), 1000) == [body]
    assert reader.unfinished is None
    feed(reader, serialize_frame(body + b"y"), 1 << 20)
    assert reader.unfinished == (CHUNK - 3, body)


def test_bytes_that_are_put_back_come_first() -> None:
    reader = FrameReader()
    data = serialize_frame(b"one") + serialize_frame(b"two")
    reader.put_back(data[:5])
    assert feed(reader, data[5:], 2) == [b"one", b"two"]


def test_memory_of_a_large_frame_doubles_as_its_bytes_come(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.core.wire.framing.FIRST_CLAIM", 2 * CHUNK)
    reader = FrameReader()
    assert feed(reader, struct.pack("<I", 9 * CHUNK), 4) == []
    room = []
    for _ in range(3):
        space = reader.space()
        room.append(len(space))
        list(reader.received(len(space)))
    assert room == [2 * CHUNK, 2 * CHUNK, 4 * CHUNK]
    assert len(reader.space()) == CHUNK


def test_frame_at_the_limit_is_taken() -> None:
    body = b"x" * (2 * CHUNK)
    assert feed(FrameReader(limit=2 * CHUNK), serialize_frame(body), CHUNK) == [body]
