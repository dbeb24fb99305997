"""wire/framing: frames in any chunks, against a slow readable reference."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.errors import WireError
from minirospy.wire.framing import CHUNK, FrameReader, serialize_frame


def feed(reader: FrameReader, data: bytes, step: int) -> list[bytes]:
    """Hand ``data`` over in pieces of at most ``step`` bytes, as a socket would."""
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


def test_a_claimed_length_costs_no_memory_before_the_bytes_come() -> None:
    reader = FrameReader()
    feed(reader, struct.pack("<I", 1 << 30), 4)
    assert len(reader.space()) <= 16 * 1024 * 1024


def test_a_frame_beyond_the_first_claim_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.wire.framing._FIRST_CLAIM", 4 * CHUNK)
    body = bytes(range(256)) * (9 * CHUNK // 256)
    assert feed(FrameReader(), serialize_frame(body), 50_000) == [body]
