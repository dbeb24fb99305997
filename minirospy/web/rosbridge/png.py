"""PNG as a compression of text: the UTF-8 bytes are the pixels of an RGB image. Pure; needs Pillow.

Source: ROSBRIDGE_PROTOCOL.md, section 3.1.2.
"""

from __future__ import annotations

import base64
import binascii
import math
from io import BytesIO
from typing import Any

from minirospy.base.errors import BridgeProtocolError

__all__ = ["decode", "encode"]

_MAX_PIXELS = 5_600_000
"""Maximum number of pixels in a client's image: 17 MB of text (3 bytes per pixel), four times that with wide characters."""


def encode(text: str) -> str:
    """Encode text as a base64-encoded PNG, roughly square and padded with newlines.

    Raise BridgeProtocolError if Pillow is not installed.
    """
    data = text.encode()
    width = max(1, math.isqrt(len(data) // 3))
    height = max(1, -(-len(data) // (3 * width)))
    buffer = BytesIO()
    picture = _pillow().frombytes("RGB", (width, height), data.ljust(3 * width * height, b"\n"))
    picture.save(buffer, "png", compress_level=1)
    return base64.b64encode(buffer.getvalue()).decode()


def decode(data: str) -> str:
    """Return the text in a base64-encoded PNG.

    Raise BridgeProtocolError if the data is invalid, the image is too large, or Pillow is not installed.
    """
    pillow = _pillow()
    try:
        picture = pillow.open(BytesIO(base64.b64decode(data, validate=True)), formats=("PNG",))
        if picture.width * picture.height > _MAX_PIXELS:
            raise BridgeProtocolError(f"a PNG of {picture.width}x{picture.height} pixels is too large")
        text: str = picture.tobytes().decode().rstrip("\n")
    except pillow.UnidentifiedImageError as error:
        raise BridgeProtocolError("the data is not a PNG of text") from error
    except (binascii.Error, OSError, ValueError, SyntaxError, pillow.DecompressionBombError) as error:
        raise BridgeProtocolError(f"the data is not a PNG of text: {error}") from error
    return text


def _pillow() -> Any:
    try:
        from PIL import Image
    except ImportError as error:
        # Clients receive this text, so omit the install command, which contains the path of the server's interpreter.
        raise BridgeProtocolError(
            "compression png needs Pillow: install minirospy[images] on the server"
        ) from error
    return Image
