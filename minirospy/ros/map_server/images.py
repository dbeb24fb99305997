"""Reads image files as pixels, with the same results as the real map_server's library.

This module decodes PGM, PBM and PPM; Pillow, if installed, decodes all other formats.
"""

from __future__ import annotations

import re
from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from minirospy.base.errors import MinirospyError
from minirospy.base.installation import install_command

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["MAX_CELLS", "ImageError", "Pixels", "read_image"]

# Maximum cells in a map: a message has at most 4 GiB, the size of 2**30 pixels with 4 channels.
MAX_CELLS = 2**30

_HEADER_NUMBER = re.compile(rb"(?:\s|#[^\n]*\n)*(\d+)")
_COMMENT = re.compile(rb"#[^\n]*")
_CHANNELS = {b"P1": 1, b"P2": 1, b"P3": 3, b"P4": 1, b"P5": 1, b"P6": 3}
_REVERSED_FORMATS = ("BMP", "TGA")


class ImageError(MinirospyError):
    """Raised if the image cannot be read. The message is one line with the reason."""


class Pixels(NamedTuple):
    """An image's bytes, with shape (rows from the top, columns, channels), and whether the last channel is alpha."""

    values: NDArray[np.uint8]
    has_alpha: bool


def read_image(data: bytes) -> Pixels:
    """Decode an image file to pixels. Raise ImageError if the file cannot be decoded."""
    if not data:
        raise ImageError("Unsupported image format: the file is empty")
    if data[:2] in _CHANNELS and data[2:3].isspace():
        return Pixels(_read_pnm(data), has_alpha=False)
    return _read_by_pillow(data)


def _read_pnm(data: bytes) -> NDArray[np.uint8]:
    """Decode a PBM, PGM or PPM file. Source: https://netpbm.sourceforge.net/doc/pnm.html."""
    kind, at = data[:2], 2
    is_bits = kind in (b"P1", b"P4")
    numbers = []
    for _ in range(2 if is_bits else 3):
        match = _HEADER_NUMBER.match(data, at)
        if match is None:
            raise ImageError("file truncated: its header has no width, height and largest value")
        numbers.append(int(match[1]))
        at = match.end()
    width, height, largest = (*numbers, 1)[:3]
    if not width or not height:
        raise ImageError("Unable to read image width and height")
    if not 0 < largest < 256:
        raise ImageError(f"unsupported PNM format: values up to {largest}, where a map has up to 255")
    if width * height > MAX_CELLS:
        raise ImageError(f"{width} x {height} pixels are more than a map can have")

    channels = _CHANNELS[kind]
    shape = (height, width, channels)
    if kind == b"P4":
        rows = _exactly(data[at + 1 :], height * ((width + 7) // 8)).reshape(height, -1)
        return np.unpackbits(rows, axis=1)[:, :width].reshape(shape)
    if kind in (b"P5", b"P6"):
        values = _exactly(data[at + 1 :], height * width * channels)
    else:
        values = _plain_values(data[at:], height * width * channels, is_bits=is_bits)
    if not is_bits and largest < 255:
        values = np.minimum(values.astype(np.uint32) * 255 // largest, 255).astype(np.uint8)
    return values.reshape(shape)


def _exactly(data: bytes, count: int) -> NDArray[np.uint8]:
    if len(data) < count:
        raise ImageError(f"file truncated: {len(data)} of {count} bytes of pixels are there")
    return np.frombuffer(data, np.uint8, count)


def _plain_values(data: bytes, count: int, *, is_bits: bool) -> NDArray[np.uint8]:
    """Parse numbers in plain text. Missing trailing numbers become 0, as in ROS."""
    text = _COMMENT.sub(b"", data)
    words = [each for each in text if each in b"01"] if is_bits else text.split()
    try:
        found = [int(bytes((each,)) if isinstance(each, int) else each) for each in words[:count]]
    except ValueError as error:
        raise ImageError(f"not an image: {error}") from error
    if found and not 0 <= min(found) <= max(found) < 256:
        raise ImageError("unsupported PNM format: a value is not between 0 and 255")
    values = np.zeros(count, np.uint8)
    values[: len(found)] = found
    return values


def _read_by_pillow(data: bytes) -> Pixels:
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError:
        raise ImageError(
            "only PGM, PPM and PBM images are read without Pillow; convert it to PGM, or install Pillow: "
            f"{install_command('minirospy[images]')}"
        ) from None
    try:
        with Image.open(BytesIO(data)) as image:
            if image.width * image.height > MAX_CELLS:
                raise ImageError(f"{image.width} x {image.height} pixels are more than a map can have")
            return _pixels_of(image)
    except UnidentifiedImageError:
        raise ImageError("Unsupported image format") from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise ImageError(str(error)) from error


def _pixels_of(image: Image.Image) -> Pixels:
    """Return an image's bytes in SDL_image's format: palette indices, and the upper byte of 16-bit values."""
    if image.mode.startswith("I"):
        values = np.asarray(image).astype(np.int64)
        return Pixels(np.clip(values >> 8, 0, 255).astype(np.uint8)[..., None], has_alpha=False)
    if image.format == "TIFF" or _has_alpha(image):
        return Pixels(_array(image.convert("RGBA")), has_alpha=True)
    if image.mode in ("L", "P"):
        return Pixels(_array(image)[..., None], has_alpha=False)
    if image.mode == "1":
        return Pixels(_array(image.convert("L"))[..., None], has_alpha=False)
    colours = _array(image.convert("RGB"))
    # Mode `scale` uses the last channel as alpha, even if it contains a color.
    return Pixels(colours[..., ::-1] if image.format in _REVERSED_FORMATS else colours, has_alpha=False)


def _has_alpha(image: Image.Image) -> bool:
    if image.mode in ("LA", "RGBA", "PA", "La", "RGBa"):
        return True
    transparency = image.info.get("transparency")
    # SDL_image keeps palette indices if exactly one color is transparent.
    return isinstance(transparency, bytes) and not (
        set(transparency) <= {0, 255} and transparency.count(0) < 2
    )


def _array(image: object) -> NDArray[np.uint8]:
    return np.asarray(image, np.uint8)
