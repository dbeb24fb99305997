"""core/bag/compression: reads all valid frames, writes strict ones, refuses damaged data and bombs."""

from __future__ import annotations

import bz2
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import lz4.frame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import BagCompressionError, BagFormatError
from minirospy.base.installation import install_command
from minirospy.core.bag.compression import BZ2, COMPRESSIONS, LZ4, check_compression, compress, decompress

BOMB_SIZE = 96 << 20  # bytes; the tests share the bombs, because compressing one takes up to a second
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
    assert refused > len(data) * 0.9  # a bz2 stream contains some bits without meaning, such as its padding


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


@cache
def bomb(name: str) -> bytes:
    """Return compressed zeros, made in pieces."""
    if name == BZ2:
        stream = bz2.BZ2Compressor()
        return b"".join(stream.compress(bytes(1 << 20)) for _ in range(BOMB_SIZE >> 20)) + stream.flush()
    with lz4.frame.LZ4FrameCompressor() as frame:
        parts = [frame.begin(), *(frame.compress(bytes(1 << 20)) for _ in range(BOMB_SIZE >> 20))]
        return b"".join((*parts, frame.flush()))


@pytest.mark.parametrize("name", [BZ2, LZ4])
def test_more_than_the_limit_is_refused_before_anything_is_decompressed(name: str) -> None:
    with pytest.raises(BagFormatError, match="a compressed chunk of 4294967295 bytes: more than 1140850688"):
        decompress(name, b"no " * 10_000_000, 2**32 - 1)


@pytest.mark.skipif(sys.platform != "linux", reason="the system tells the peak in other units, or not")
@pytest.mark.parametrize("name", [BZ2, LZ4])
@pytest.mark.parametrize("announced", [96, 100, 40])
def test_much_data_is_in_memory_once(name: str, announced: int, tmp_path: Path) -> None:
    file = tmp_path / "data"
    file.write_bytes(bomb(name))
    program = f"""
import resource, sys
from minirospy.core.bag.compression import decompress
from minirospy.base.errors import BagFormatError
data = open(sys.argv[1], "rb").read()
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    print(len(decompress({name!r}, data, {announced} << 20)) >> 20)
except BagFormatError as error:
    print(error)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024)
"""
    done = subprocess.run([sys.executable, "-c", program, file], capture_output=True, text=True, check=True)
    result, peak = done.stdout.splitlines()
    assert (
        result
        == {
            96: "96",
            100: f"a chunk has {96 << 20} bytes instead of {100 << 20}",
            40: f"a chunk has more than {40 << 20} bytes",
        }[announced]
    )
    assert int(peak) < min(announced, 96) + 60  # MiB


def test_many_bz2_streams_are_refused() -> None:
    # The data after a stream used to be copied for each stream, so that the time grew as the square of their number.
    with pytest.raises(BagFormatError, match="more than 20000 bz2 streams"):
        decompress(BZ2, bz2.compress(b"") * 700_000, 10)
    assert decompress(BZ2, bz2.compress(b"ab") * 10_000 + bz2.compress(b""), 20_000) == b"ab" * 10_000


@pytest.mark.parametrize("name", [BZ2, LZ4])
def test_unneeded_chunks_are_not_decompressed(name: str) -> None:
    asked: list[int] = []

    def is_cancelled() -> bool:
        asked.append(1)
        return len(asked) > 2

    with pytest.raises(BagFormatError, match="not needed any more"):
        decompress(name, bomb(name), BOMB_SIZE, is_cancelled)
    assert len(asked) == 3
