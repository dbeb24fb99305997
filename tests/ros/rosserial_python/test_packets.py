"""packets: conversion between serial bytes and packets."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.ros.rosserial_python.devices.packets import Decoder, Fault, Packet, WrongVersion, encode

PIECES = st.lists(st.binary(max_size=20), max_size=8)


def test_packets_are_those_of_the_protocol() -> None:
    # The requests for topics and for silence, from the protocol's documentation.
    assert encode(0, b"") == bytes.fromhex("ff fe 00 00 ff 00 00 ff")
    assert encode(11, b"") == bytes.fromhex("ff fe 00 00 ff 0b 00 f4")
    # 3 bytes on topic 258, with checksums of 03 00, and of 02 01 with the data.
    assert encode(258, b"abc") == bytes.fromhex("ff fe 03 00 fc 02 01 61 62 63 d6")


@given(st.lists(st.tuples(st.integers(0, 65535), st.binary(max_size=300)), max_size=5), st.integers(1, 50))
def test_packets_survive_any_pieces(packets: list[tuple[int, bytes]], size: int) -> None:
    line = b"".join(encode(*each) for each in packets)
    decoder = Decoder()
    found = [each for at in range(0, len(line), size) for each in decoder.feed(line[at : at + size])]
    assert found == [Packet(*each) for each in packets]
    assert (decoder.missing, decoder.received) == (0, 0)


@given(PIECES)
def test_any_bytes_are_packets_or_faults(pieces: list[bytes]) -> None:
    decoder = Decoder()
    for piece in (*pieces, b"\xff\xfe", *pieces):
        for found in decoder.feed(piece):
            assert isinstance(found, Packet | Fault | WrongVersion)


GOOD = encode(5, b"good")


@pytest.mark.parametrize(
    ("broken", "faults"),
    [
        (b"garbage", []),
        (b"\xff\xff", [WrongVersion(0xFF)]),
        (b"\xff\x41", [WrongVersion(0x41)]),
        (b"\xff\xfe\x09\x00\x00", [Fault("Wrong checksum for msg length, length 9, dropping message.")]),
        (GOOD[:-1] + b"\x00", [Fault("wrong checksum for topic id and msg")]),
    ],
)
def test_packet_behind_a_broken_one_is_found(broken: bytes, faults: list[object]) -> None:
    assert list(Decoder().feed(broken + GOOD)) == [*faults, Packet(5, b"good")]


@pytest.mark.parametrize(
    ("count", "step", "missing"),
    [(0, "syncflag", 0), (1, "protocol", 1), (3, "message length", 2), (6, "topic id", 6), (9, "data", 3)],
)
def test_step_and_missing_bytes_are_those_of_a_part(count: int, step: str, missing: int) -> None:
    decoder = Decoder()
    assert list(decoder.feed(GOOD[:count])) == []
    assert (decoder.step, decoder.missing) == (step, missing)
    decoder.reset()
    assert list(decoder.feed(GOOD)) == [Packet(5, b"good")]


def test_too_long_data_is_refused() -> None:
    assert len(encode(1, bytes(65535))) == 65543
    with pytest.raises(ValueError, match="65536 bytes: a packet holds 65535"):
        encode(1, bytes(65536))
