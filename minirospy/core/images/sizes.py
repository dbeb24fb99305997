"""Read the width and height of a compressed image from its header. Pure: nothing is decompressed.

A file of a few kilobytes may have 10,000 x 10,000 pixels, for which a decoder uses a gigabyte, so servers check the size
first. Sources: PNG (third edition), ITU T.81 (JPEG), GIF89a, RFC 9649 (WebP), TIFF 6.0, ITU T.800 (JPEG 2000), netpbm, BMP.
"""

from __future__ import annotations

import re
import struct

__all__ = ["size_of"]

_NETPBM = re.compile(rb"P[1-6](?:\s+|#[^\n]*\n)+(\d{1,9})(?:\s+|#[^\n]*\n)+(\d{1,9})\s")
_JPEG_FRAMES = {0xC0, 0xC1, 0xC2, 0xC3, 0xC5, 0xC6, 0xC7, 0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF}
"""JPEG markers that are followed by the image's size."""
_JPEG_PLAIN = {0x01, 0xFF, *range(0xD0, 0xD9)}
"""JPEG markers without a length: a fill byte, restarts, the start of the image."""
_MAX_MARKERS = 10_000
_TIFF_WIDTH, _TIFF_HEIGHT = 256, 257
_TIFF_SHORT, _TIFF_LONG = 3, 4


def size_of(data: bytes) -> tuple[int, int] | None:
    """Return width and height, or None if the format is unknown or the header is invalid."""
    try:
        for magic, read in _READERS.items():
            if data.startswith(magic):
                return read(data)
    except (struct.error, IndexError):
        return None
    found = _NETPBM.match(data[:10_000])
    return (int(found[1]), int(found[2])) if found else None


def _png(data: bytes) -> tuple[int, int] | None:
    return _pair(">II", data, 16) if data[12:16] == b"IHDR" else None


def _gif(data: bytes) -> tuple[int, int]:
    return _pair("<HH", data, 6)


def _bmp(data: bytes) -> tuple[int, int]:
    (head,) = struct.unpack_from("<I", data, 14)
    if head == 12:
        return _pair("<HH", data, 18)
    width, height = _pair("<ii", data, 18)
    # Drop the sign: a negative height only means that the first row is the top one.
    return abs(width), abs(height)


def _jpeg(data: bytes) -> tuple[int, int] | None:
    at = 2
    for _ in range(_MAX_MARKERS):
        if data[at] != 0xFF:
            return None
        marker = data[at + 1]
        if marker in _JPEG_FRAMES:
            height, width = _pair(">HH", data, at + 5)
            return width, height
        if marker in _JPEG_PLAIN:
            at += 1 if marker == 0xFF else 2
        else:
            at += 2 + int(struct.unpack_from(">H", data, at + 2)[0])
    return None


def _webp(data: bytes) -> tuple[int, int] | None:
    if data[8:12] != b"WEBP":
        return None
    kind = data[12:16]
    if kind == b"VP8X" and len(data) >= 30:
        return 1 + int.from_bytes(data[24:27], "little"), 1 + int.from_bytes(data[27:30], "little")
    if kind == b"VP8L":
        (bits,) = struct.unpack_from("<I", data, 21)
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    if kind == b"VP8 ":
        width, height = _pair("<HH", data, 26)
        return width & 0x3FFF, height & 0x3FFF
    return None


def _tiff(data: bytes) -> tuple[int, int] | None:
    order = "<" if data.startswith(b"II") else ">"
    (at,) = struct.unpack_from(f"{order}I", data, 4)
    (count,) = struct.unpack_from(f"{order}H", data, at)
    found: dict[int, int] = {}
    for entry in range(at + 2, at + 2 + 12 * count, 12):
        tag, kind = struct.unpack_from(f"{order}HH", data, entry)
        if tag in (_TIFF_WIDTH, _TIFF_HEIGHT) and kind in (_TIFF_SHORT, _TIFF_LONG):
            found[tag] = struct.unpack_from(f"{order}{'H' if kind == _TIFF_SHORT else 'I'}", data, entry + 8)[
                0
            ]
    if len(found) < 2:
        return None
    return found[_TIFF_WIDTH], found[_TIFF_HEIGHT]


def _jpeg_2000(data: bytes) -> tuple[int, int] | None:
    # The SIZ marker directly follows the start of the codestream.
    at = data.find(b"\xff\x4f\xff\x51")
    if at < 0:
        return None
    width, height, left, top = struct.unpack_from(">IIII", data, at + 8)
    return width - left, height - top


def _pair(format_: str, data: bytes, at: int) -> tuple[int, int]:
    first, second = struct.unpack_from(format_, data, at)
    return int(first), int(second)


_READERS = {
    b"\x89PNG\r\n\x1a\n": _png,
    b"\xff\xd8": _jpeg,
    b"GIF8": _gif,
    b"BM": _bmp,
    b"RIFF": _webp,
    b"II*\0": _tiff,
    b"MM\0*": _tiff,
    b"\0\0\0\x0cjP  ": _jpeg_2000,
    b"\xff\x4f\xff\x51": _jpeg_2000,
}  # dict from a format's first bytes to the function that reads an image's size
