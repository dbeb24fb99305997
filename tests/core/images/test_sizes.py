"""Sizes of compressed images read from their headers, compared with Pillow's; images that are too large are never decoded."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pillow

from minirospy.core.images import compressed
from minirospy.core.images.compressed import MAX_PIXELS, decode
from minirospy.core.images.sizes import size_of

FORMATS = (
    ("png", "RGB", {}),
    ("png", "L", {}),
    ("jpeg", "RGB", {}),
    ("jpeg", "RGB", {"progressive": True, "exif": b"Exif\0\0" + bytes(5000)}),
    ("gif", "P", {}),
    ("bmp", "RGB", {}),
    ("tiff", "RGB", {}),
    ("tiff", "L", {"compression": "tiff_lzw"}),
    ("webp", "RGB", {}),
    ("webp", "RGBA", {"lossless": True}),
    ("webp", "RGB", {"exif": b"Exif\0\0" + bytes(50)}),
    ("jpeg2000", "RGB", {}),
    ("jpeg2000", "RGB", {"no_jp2": True}),
    ("ppm", "RGB", {}),
    ("ppm", "L", {}),
    ("ppm", "1", {}),
)


def file_of(size: tuple[int, int], format_: str, mode: str, options: dict[str, object]) -> bytes:
    buffer = BytesIO()
    Pillow.new(mode, size).save(buffer, format_, **options)  # type: ignore[arg-type]
    return buffer.getvalue()


@pytest.mark.parametrize(("format_", "mode", "options"), FORMATS)
@pytest.mark.parametrize("size", [(1, 1), (3, 200), (300, 17)])
def test_size_is_that_of_the_image(
    size: tuple[int, int], format_: str, mode: str, options: dict[str, object]
) -> None:
    data = file_of(size, format_, mode, options)
    assert size_of(data) == size
    for end in range(min(len(data), 60)):
        assert size_of(data[:end]) in (None, size)


@pytest.mark.parametrize(
    ("data", "size"),
    [
        (b"P5\n# made by hand\n12 # width\n 34\n255\n", (12, 34)),
        (b"P4 7 9 x", (7, 9)),
        (b"BM" + bytes(12) + struct.pack("<IHH", 12, 5, 6), (5, 6)),
        (b"BM" + bytes(12) + struct.pack("<Iii", 40, 5, -6), (5, 6)),
        (b"\xff\xd8\xff\xff\xff\xe0\0\x02\xff\xc2\0\x11\x08\0\x09\0\x08", (8, 9)),
        (
            b"MM\0*\0\0\0\x08\0\x02" + struct.pack(">HHIIHHIHH", 256, 4, 1, 70_000, 257, 3, 1, 5, 0),
            (70_000, 5),
        ),
        (b"MM\0*\0\0\0\x08\0\x01" + struct.pack(">HHII", 256, 4, 1, 70_000), None),
        (b"MM\0*\0\0\0\x08\0\x02" + struct.pack(">HHIIHHII", 256, 2, 1, 7, 257, 4, 1, 5), None),
        (b"\xff\xd8\xff\xe0\0\x02no", None),
        (b"\xff\xd8" + b"\xff\xe0\0\x00" * 20_000, None),
        (b"\xff\xd8" + b"\xff" * 20_000 + b"\xc0\0\x11\x08\0\x09\0\x08", None),
        (b"RIFF\0\0\0\0WAVEfmt " + bytes(40), None),
        (b"RIFF\0\0\0\0WEBPVP9 " + bytes(40), None),
        (b"\x89PNG\r\n\x1a\n\0\0\0\x0dIDAT" + bytes(20), None),
        (b"\0\0\0\x0cjP  \r\n\x87\n", None),
        (
            b"\0\0\0\x0cjP  \r\n\x87\n\xff\x4f\xff\x51" + struct.pack(">HHIIII", 47, 0, 50, 60, 10, 20),
            (40, 40),
        ),
        (b"P7\nWIDTH 5\n", None),
        (b"", None),
        (b"text", None),
    ],
)
def test_heads_that_are_made_by_hand(data: bytes, size: tuple[int, int] | None) -> None:
    assert size_of(data) == size


@given(
    st.sampled_from([b"\x89PNG\r\n\x1a\n", b"\xff\xd8", b"RIFF", b"II*\0", b"BM", b"\xff\x4f\xff\x51"]),
    st.binary(max_size=80),
)
def test_any_bytes_have_a_size_or_none(head: bytes, rest: bytes) -> None:
    found = size_of(head + rest)
    assert found is None or all(isinstance(each, int) for each in found)


def large_png(width: int, height: int) -> bytes:
    """Return a PNG of some hundred kilobytes with this size and no pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack("!I", len(data)) + kind + data + struct.pack("!I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack("!IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(bytes(100_000))) + chunk(b"IEND", b"")


class Decoder:
    """A library that must not be called."""

    IMREAD_UNCHANGED = -1

    def imdecode(self, *_: object) -> object:
        pytest.fail("a large image was decoded")


@pytest.mark.parametrize("library", ["OpenCV", "Pillow"])
def test_large_image_is_refused_before_it_is_decoded(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compressed, "opencv", lambda: Decoder() if library == "OpenCV" else None)
    if library == "Pillow":
        monkeypatch.setattr(Pillow, "open", lambda *_: pytest.fail("a large image was opened"))
    with pytest.raises(ValueError, match=f"13000x13000 pixels is too large: {MAX_PIXELS} are allowed"):
        decode(large_png(13_000, 13_000))
    with pytest.raises(ValueError, match="20x30 pixels is too large: 599 are allowed"):
        decode(large_png(20, 30), max_pixels=599)
    if library == "OpenCV":
        # The size of such a file is not known before it is decoded.
        with pytest.raises(ValueError, match="an image format that is not known"):
            decode(b"#?RADIANCE\n", max_pixels=600)


def test_size_that_only_pillow_knows_is_limited_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compressed, "opencv", lambda: None)
    data = file_of((20, 30), "tga", "RGB", {})
    assert size_of(data) is None
    assert decode(data, max_pixels=600).shape == (30, 20, 3)
    with pytest.raises(ValueError, match="20x30 pixels is too large"):
        decode(data, max_pixels=599)


FRAMES = [0xC0, 0xC1, 0xC2, 0xC3, 0xC5, 0xC6, 0xC7, 0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF]


@pytest.mark.parametrize("marker", range(0xC0, 0xD0))
def test_size_of_a_jpeg_is_behind_each_of_its_frame_markers(marker: int) -> None:
    frame = bytes((0xFF, marker)) + b"\0\x11\x08\0\x09\0\x08" + bytes(10)
    last = b"\xff\xc0\0\x11\x08\0\x07\0\x06" + bytes(10)
    # The other markers in this range are tables, which are skipped by their length.
    assert size_of(b"\xff\xd8" + frame + last) == ((8, 9) if marker in FRAMES else (6, 7))


@pytest.mark.parametrize(
    "plain", [b"\xff\x01", b"\xff", b"\xff\xff\xff", *(bytes((0xFF, each)) for each in range(0xD0, 0xD9))]
)
def test_markers_without_a_length_are_passed_over(plain: bytes) -> None:
    assert size_of(b"\xff\xd8" + plain + b"\xff\xc0\0\x11\x08\0\x09\0\x08") == (8, 9)


@pytest.mark.parametrize("marker", [0x02, 0xD9, 0xDA, 0xE0, 0xFE])
def test_markers_with_a_length_are_passed_over_by_it(marker: int) -> None:
    head = b"\xff\xd8" + bytes((0xFF, marker)) + b"\0\x05abc"
    assert size_of(head + b"\xff\xc0\0\x11\x08\0\x09\0\x08") == (8, 9)


@pytest.mark.parametrize("count", [9_999, 10_000])
def test_markers_before_the_size_are_limited(count: int) -> None:
    data = b"\xff\xd8" + b"\xff\x01" * count + b"\xff\xc0\0\x11\x08\0\x09\0\x08"
    assert size_of(data) == ((8, 9) if count < 10_000 else None)


def test_shortest_heads_have_a_size() -> None:
    extended = b"RIFF\0\0\0\0WEBPVP8X\x0a\0\0\0\0\0\0\0" + b"\x04\0\0" + b"\x09\0\0"
    assert len(extended) == 30
    assert size_of(extended) == (5, 10)
    assert size_of(extended[:-1]) is None
    # The entries of a TIFF need not be at the start.
    entries = struct.pack("<HHHIIHHII", 2, 256, 4, 1, 70_000, 257, 4, 1, 5)
    assert size_of(b"II*\0" + struct.pack("<I", 100) + bytes(92) + entries) == (70_000, 5)
