"""bag/compression: every frame is read, the strict one is written, damage and bombs are refused."""

from __future__ import annotations

import bz2
import os
import re

import lz4.frame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.bag.compression import BZ2, COMPRESSIONS, LZ4, check_compression, compress, decompress
from minirospy.errors import BagCompressionError, BagFormatError
from minirospy.installation import install_command

LARGE = os.urandom(700_000) + b"ros " * 700_000


@pytest.mark.parametrize("name", COMPRESSIONS)
@given(data=st.binary())
def test_data_returns(name: str, data: bytes) -> None:
    assert decompress(name, compress(name, data), len(data)) == data


@pytest.mark.parametrize("name", COMPRESSIONS)
def test_large_data_returns(name: str) -> None:
    assert decompress(name, compress(name, memoryview(LARGE)), len(LARGE)) == LARGE


def test_lz4_frame_is_the_one_that_roslz4_requires() -> None:
    frame = compress(LZ4, LARGE)
    magic, flags, descriptor = frame[:4], frame[4], frame[5]

    assert magic == b"\x04\x22\x4d\x18"
    assert (
        flags == 0b01_1_0_0_1_0_0
    )  # version 1, independent blocks, content checksum, no size, no dictionary
    assert descriptor == 6 << 4  # blocks of 1 MiB


@pytest.mark.parametrize("linked", [True, False])
@pytest.mark.parametrize("checksum", [True, False])
@pytest.mark.parametrize("size", [True, False])
def test_every_lz4_frame_is_read(linked: bool, checksum: bool, size: bool) -> None:
    frame = lz4.frame.compress(
        LARGE, block_linked=linked, content_checksum=checksum, block_checksum=checksum, store_size=size
    )
    assert decompress(LZ4, frame, len(LARGE)) == LARGE


def test_bz2_of_several_streams_is_read() -> None:
    assert decompress(BZ2, bz2.compress(b"ab") + bz2.compress(b"cd"), 4) == b"abcd"


@pytest.mark.parametrize("name", [BZ2, LZ4])
def test_truncated_data_is_refused(name: str) -> None:
    data = compress(name, b"hello " * 1000)

    for end in range(len(data)):
        with pytest.raises(BagFormatError):
            decompress(name, data[:end], 6000)


@pytest.mark.parametrize("name", [BZ2, LZ4])
def test_flipped_bytes_are_refused_or_have_no_effect(name: str) -> None:
    data = compress(name, b"hello " * 1000)

    refused = 0
    for at in range(len(data)):
        damaged = data[:at] + bytes((data[at] ^ 0xFF,)) + data[at + 1 :]
        try:
            assert decompress(name, damaged, 6000) == b"hello " * 1000
        except BagFormatError:
            refused += 1
    assert refused > len(data) * 0.9  # a bz2 stream has bits that mean nothing, such as its padding


@pytest.mark.parametrize("name", COMPRESSIONS)
@pytest.mark.parametrize("size", [5999, 6001, 0])
def test_data_of_another_size_is_refused(name: str, size: int) -> None:
    with pytest.raises(BagFormatError, match=f"{size}"):
        decompress(name, compress(name, b"hello " * 1000), size)


@pytest.mark.parametrize("name", ["zstd", "", "NONE"])
def test_unknown_compression_is_refused_by_name(name: str) -> None:
    with pytest.raises(BagCompressionError, match=f"unsupported compression type: {name}"):
        decompress(name, b"", 0)
    with pytest.raises(BagCompressionError, match="it must be one of: none, bz2, lz4"):
        check_compression(name)


def test_missing_lz4_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "lz4.frame", None)

    with pytest.raises(BagCompressionError, match=re.escape(install_command("lz4"))):
        check_compression(LZ4)
