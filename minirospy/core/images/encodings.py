"""Image encodings, and conversions between them, with numpy. Pure.

The numbers are OpenCV's: a type is a depth plus eight times the number of channels minus one. The results of conversions
are bit for bit the same as OpenCV's. Source: sensor_msgs/image_encodings.h, https://docs.opencv.org (cvtColor, convertTo).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Pixels: TypeAlias = NDArray[Any]
    """An image of any depth: (height, width) or (height, width, channels)."""

__all__ = ["DEPTHS", "converted", "is_converted_by_opencv", "type_of_encoding"]

DEPTHS = {
    "8U": "uint8",
    "8S": "int8",
    "16U": "uint16",
    "16S": "int16",
    "32S": "int32",
    "32F": "float32",
    "64F": "float64",
}  # numpy types, indexed by OpenCV's depth

_GENERIC = re.compile(r"(8U|8S|16U|16S|32S|32F|64F)(?:C(\d+))?\Z")
_CHANNELS = {"mono": "Y", "bgr": "BGR", "rgb": "RGB", "bgra": "BGRA", "rgba": "RGBA"}
_COLOR = re.compile(r"(mono|bgra?|rgba?|bayer_(?:rggb|bggr|gbrg|grbg))(8|16)\Z")
_YUV = "yuv422"
_GRAY = (9798, 19235, 3735)  # OpenCV's weights for red, green and blue, times 2**15


def type_of_encoding(encoding: str) -> int:
    """Return the type number of an encoding. Raise ValueError if it is unknown."""
    if encoding == _YUV:
        return _type("8U", 2)
    if match := _COLOR.match(encoding):
        channels = len(_CHANNELS.get(match[1], "?"))
        return _type(f"{match[2]}U", channels)
    if match := _GENERIC.match(encoding):
        return _type(match[1], int(match[2] or 1))
    raise ValueError(f"Unrecognized image encoding [{encoding}]")


def _type(depth: str, channels: int) -> int:
    return list(DEPTHS).index(depth) + 8 * (channels - 1)


def is_converted_by_opencv(source: str, wanted: str) -> bool:
    """Return whether a conversion needs OpenCV. Only conversions from a Bayer pattern or YUV to colors do."""
    return (
        _kind(source) in ("bayer", _YUV)
        and _kind(wanted) == "color"
        and not (source == _YUV and wanted.startswith("mono"))
    )


def converted(image: Pixels, source: str, wanted: str) -> Pixels:
    """Convert an image to another encoding. Return the same array if nothing changes.

    Raise ValueError, with ROS's message, if there is no such conversion.
    """
    channels = type_of_encoding(source) // 8
    if wanted in ("", source):
        return image
    try:
        type_of_encoding(wanted)
    except ValueError:
        raise ValueError(f"Unknown encoding {wanted}") from None

    kinds = _kind(source), _kind(wanted)
    if not kinds[0]:
        if kinds[1]:
            raise ValueError(
                f"[{source}] is not a color format. but [{wanted}] is. The conversion does not make sense"
            )
        if channels != type_of_encoding(wanted) // 8:
            raise ValueError(f"[{source}] and [{wanted}] do not have the same number of channel")
    elif not kinds[1]:
        if channels != type_of_encoding(wanted) // 8:
            raise ValueError(
                f"[{source}] is a color format but [{wanted}] is not so they must have the same OpenCV type, "
                "CV_8UC3, CV16UC1 ...."
            )
    else:
        image = _recolored(image, source, wanted)
    return _of_depth(image, source, wanted)


def _kind(encoding: str) -> str:
    """Return "color", "bayer" or "yuv422", or "" for an encoding without colors."""
    if encoding == _YUV:
        return _YUV
    match = _COLOR.match(encoding)
    if not match:
        return ""
    return "color" if match[1] in _CHANNELS else "bayer"


def _recolored(image: Pixels, source: str, wanted: str) -> Pixels:
    """Convert an image's channels to another encoding's, without changing the depth."""
    import numpy as np

    if source == _YUV and wanted.startswith("mono"):
        return np.ascontiguousarray(image[..., 1])
    if _kind(source) != "color" or _kind(wanted) != "color":
        raise ValueError(f"Unsupported conversion from [{source}] to [{wanted}]")

    before, after = (_CHANNELS[each.rstrip("0123456789")] for each in (source, wanted))
    if before == after:
        return image
    if after == "Y":
        # 32 bits suffice for 16-bit values times 2**15.
        red, green, blue = (image[..., before.index(each)].astype(np.uint32) for each in "RGB")
        sums = red * _GRAY[0] + green * _GRAY[1] + blue * _GRAY[2]
        return ((sums + (1 << 14)) >> 15).astype(image.dtype)

    result = np.empty((*image.shape[:2], len(after)), image.dtype)
    for at, channel in enumerate(after):
        if channel in before or (before == "Y" and channel != "A"):
            result[..., at] = image if before == "Y" else image[..., before.index(channel)]
        else:
            result[..., at] = np.iinfo(image.dtype).max
    return result


def _of_depth(image: Pixels, source: str, wanted: str) -> Pixels:
    """Convert an image to another depth. Between 8 and 16 bits, scale the values; otherwise round and clip them."""
    import numpy as np

    depths = list(DEPTHS)
    before, after = (depths[type_of_encoding(each) % 8] for each in (source, wanted))
    if before == after:
        return image
    dtype = np.dtype(DEPTHS[after])
    bits = before[:-1], after[:-1]
    factor = {("8", "16"): 65535 / 255, ("16", "8"): 255 / 65535}.get(bits, 1.0)
    if dtype.kind == "f":
        return image.astype(dtype)

    values = image.astype(np.float64) * factor
    with np.errstate(invalid="ignore"):
        values = np.rint(values)
        # As in OpenCV, NaN and values outside an int's range become the int's minimum, which is then clipped.
        values[~((values >= -(2.0**31)) & (values < 2.0**31))] = -(2.0**31)
    limits = np.iinfo(dtype)
    return np.clip(values, limits.min, limits.max).astype(dtype)
