"""Convert YUV images and Bayer patterns to BGR with numpy; the results are bit-identical to OpenCV's. Pure.

Source: https://docs.opencv.org (cvtColor), ITU-R BT.601. tests/core/images/record_colors.py records OpenCV's results.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.core.images.encodings import Pixels

__all__ = ["debayered", "eight_bits", "yuv_to_bgr"]

# YUV-to-RGB factors, times 2 ** 20: for luminance; V in red; U and V in green; U in blue.
_Y, _RED_V, _GREEN_U, _GREEN_V, _BLUE_U = 1220542, 1673527, -409993, -852492, 2116026
_BITS = 20


def yuv_to_bgr(image: Pixels, *, has_luma_first: bool) -> Pixels:
    """Convert an image with two bytes per pixel (U Y V Y, or Y U Y V if ``has_luma_first``) and an even width.

    Raise ValueError if the width is odd.
    """
    import numpy as np

    height, width = image.shape[:2]
    if width % 2:
        raise ValueError(f"an image of YUV 4:2:2 has an even width, not {width}")
    luma_at = 0 if has_luma_first else 1
    luma = np.maximum(image[..., luma_at].astype(np.int32) - 16, 0) * _Y + (1 << (_BITS - 1))
    chroma = image[..., 1 - luma_at].astype(np.int32).reshape(height, width // 2, 2) - 128
    u, v = (np.repeat(chroma[..., at], 2, axis=1) for at in (0, 1))
    result = np.empty((height, width, 3), np.uint8)
    for at, added in enumerate((_BLUE_U * u, _GREEN_U * u + _GREEN_V * v, _RED_V * v)):
        result[..., at] = np.clip((luma + added) >> _BITS, 0, 255)
    return result


def debayered(image: Pixels, pattern: str) -> Pixels:
    """Convert a Bayer pattern, such as ``rggb``, to BGR of the same depth. Missing colors are averages of neighbors.

    The outermost pixels copy the colors of the pixels next to them. In an image with fewer than three rows or columns, each cell
    of four pixels has one color.
    """
    import numpy as np

    height, width = image.shape
    if min(height, width) < 3:
        return _of_cells(image, pattern)

    result = np.empty((height, width, 3), image.dtype)
    inner = result[1:-1, 1:-1]
    values = image.astype(np.uint32)
    beside = (values[1:-1, :-2] + values[1:-1, 2:] + 1) >> 1
    above = (values[:-2, 1:-1] + values[2:, 1:-1] + 1) >> 1
    cross = (values[:-2, 1:-1] + values[2:, 1:-1] + values[1:-1, :-2] + values[1:-1, 2:] + 2) >> 2
    corners = (values[:-2, :-2] + values[:-2, 2:] + values[2:, :-2] + values[2:, 2:] + 2) >> 2
    for row in (0, 1):
        for column in (0, 1):
            # The inner pixels start at (1, 1).
            own = pattern[(1 - row) * 2 + (1 - column)]
            rows, columns = slice(row, None, 2), slice(column, None, 2)
            part = inner[rows, columns]
            own_values = values[1:-1, 1:-1][rows, columns]
            if own == "g":
                neighbor = pattern[(1 - row) * 2 + column]  # the other color in the same row
                part[..., 1] = own_values
                part[..., "bgr".index(neighbor)] = beside[rows, columns]
                part[..., "bgr".index("b" if neighbor == "r" else "r")] = above[rows, columns]
            else:
                part[..., "bgr".index(own)] = own_values
                part[..., 1] = cross[rows, columns]
                part[..., "bgr".index("b" if own == "r" else "r")] = corners[rows, columns]
    result[0], result[-1] = result[1], result[-2]
    result[:, 0], result[:, -1] = result[:, 1], result[:, -2]
    return result


def _of_cells(image: Pixels, pattern: str) -> Pixels:
    import numpy as np

    height, width = (size // 2 * 2 for size in image.shape)
    cells = [image[at // 2 : height : 2, at % 2 : width : 2].astype(np.uint32) for at in range(4)]
    colors = {
        color: [cell for cell, name in zip(cells, pattern, strict=True) if name == color] for color in "bgr"
    }
    planes = [sum(found[1:], found[0]) // len(found) for found in colors.values()]
    return np.stack(planes, axis=-1).astype(image.dtype)


def eight_bits(image: Pixels) -> Pixels:
    """Convert an image from 16 to 8 bits per channel, rounding as OpenCV does."""
    import numpy as np

    result: Pixels = np.rint(image * np.float64(255 / 65535)).astype(np.uint8)
    return result
