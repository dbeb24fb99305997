"""Return an image message's pixels, without a copy if the byte order is this machine's. Pure."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from minirospy.core.images.encodings import DEPTHS, type_of_encoding

if TYPE_CHECKING:
    from sensor_msgs.msg import Image

    from minirospy.core.images.encodings import Pixels

__all__ = ["pixels"]


def pixels(message: Image) -> Pixels:
    """Return a message's image: (height, width) or (height, width, channels), in the message's encoding.

    The result is a read-only view unless the byte order must be changed. Padding after the rows (``step``) is removed.
    Raise ValueError if the encoding is unknown, or there is less data than the size requires.
    """
    import numpy as np

    number = type_of_encoding(message.encoding)
    channels = number // 8 + 1
    dtype = np.dtype(list(DEPTHS.values())[number % 8]).newbyteorder(">" if message.is_bigendian else "<")
    row = message.width * channels * dtype.itemsize
    # Compute the row length if ``step`` is too small; some drivers do not set it.
    step = message.step if message.step >= row else row
    needed = max(message.height - 1, 0) * step + (row if message.height else 0)
    data = message.data
    if isinstance(data, str):
        data = data.encode()
    if len(data) < needed:
        raise ValueError(
            f"the image of {message.width}x{message.height} [{message.encoding}] needs {needed} bytes, "
            f"its data has {len(data)}"
        )

    shape, strides = (
        (message.height, message.width, channels),
        (step, channels * dtype.itemsize, dtype.itemsize),
    )
    dimensions = 2 if channels == 1 else 3
    image: Pixels = np.ndarray(
        shape[:dimensions], dtype, data if needed else bytes(1), 0, strides[:dimensions]
    )
    if dtype.itemsize > 1 and bool(message.is_bigendian) == (sys.byteorder == "little"):
        image = image.astype(dtype.newbyteorder("="))
    return image
