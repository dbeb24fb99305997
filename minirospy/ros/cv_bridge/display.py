"""cvtColorForDisplay: converts images of any encoding for display in a window. Source: API documentation of cv_bridge in C++."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.core.images.encodings import DEPTHS, type_of_encoding
from minirospy.ros.cv_bridge.cv_bridge.core import CvBridgeError, _converted

if TYPE_CHECKING:
    from minirospy.core.images.encodings import Pixels

__all__ = ["cvtColorForDisplay"]

_LABEL_COLORS = bytes.fromhex(
    "eff8fff9ebd600ffff7effd3effffff5f5dcffe3c4000000ffebcd0000ff892be1a42a2adeb8865f9e9f7eff00d2691eff7e506394ec"
    "fff8dcdc133b00ffff00008a008a8ab8850aa9a9a9006300a9a9a9bcb76b8a008a546b2eff8b009931cc8a0000e995798fbb8f473c8a"
    "2e4f4f2e4f4f00ced19300d2ff139200beff6969696969691e90ffb12121fff9ef218a21ff00ffdcdcdcf8f8ffffd600daa41f808080"
    "008000acff2e808080efffefff69b4cd5c5c4a0082ffffefefe68be6e6f9ffeff57bfb00fff9cdacd7e6ef8080dffffff9f9d2d2d2d2"
    "90ed90d2d2d2ffb6c1ff9f791fb1aa86cef9778799778799afc4deffffdf00ff0031cd31f9efe6ff00ff80000066cdaa0000cdb954d2"
    "926fdb3bb3707a68ed00f99a47d1ccc6158518186ff5fff9ffe3e0ffe3b5ffdeac000080fcf5e68080006b8e22ffa400ff4500da6fd5"
    "ede8aa97fa97aeededffeed4ffdab8cd853effc0cadd9fddafdfe6800080ff0000bb8f8f4169e08a4512f98071f9a35f2d8a56fff5ed"
    "9f522cc0c0c086ceeb6a5acd6f80906f8090fff9f900ff7e4682b4d2b48b008080d7bed7ff624640dfd0ed82edf5deb3fffffff5f5f5"
    "ffff009acd31"
)
"""Red, green and blue for labels 0, 1, ...: CSS's named colors in alphabetical order, rounded as in ROS."""

_SHOWN = ("rgb8", "bgr8", "rgba8", "bgra8", "mono8")
_GRAY = 128  # gray level for an image without contrast
_LEGACY = {
    "CV_8UC1": "mono8",
    "16UC1": "mono16",
    "CV_8UC3": "bgr8",
    "CV_8UC4": "bgra8",
    "CV_16UC3": "bgr16",
    "CV_16UC4": "bgra16",
}
"""For encodings without color information: the encodings as which they are interpreted."""


def cvtColorForDisplay(
    source: Pixels,
    encoding_in: str,
    encoding_out: str,
    do_dynamic_scaling: bool = False,
    min_image_value: float = 0.0,
    max_image_value: float = 0.0,
) -> Pixels:
    """Return an 8-bit image for display in a window; ``encoding_out`` is a color or mono encoding, or "" for bgr8.

    An image with one channel is scaled from ``min_image_value`` and ``max_image_value`` if they differ, or from its own
    minimum and maximum if ``do_dynamic_scaling``. Labels (32SC1) become colors. Raise RuntimeError if there is no such
    conversion.
    """
    import numpy as np

    wanted = encoding_out or _guessed(encoding_in)
    if wanted not in _SHOWN:
        raise RuntimeError(
            "cv_bridge.cvtColorForDisplay() does not have an output encoding that is color or mono, and has is bit in depth"
        )
    if wanted == "bgr8" and encoding_in == "32SC1":
        return _labels(source)

    low, high = min_image_value, max_image_value
    if do_dynamic_scaling:
        low, high = float(np.nanmin(source)), float(np.nanmax(source))
        if low == high:
            return np.full((*source.shape[:2], 3), _GRAY, np.uint8)

    if low != high:
        if type_of_encoding(encoding_in) >= len(DEPTHS):
            raise RuntimeError(
                "cv_bridge.cvtColorForDisplay() scaling for images with more than one channel is unsupported"
            )
        source, known = _scaled(source, low, high), "mono8"
    else:
        known = _LEGACY.get(encoding_in, encoding_in)

    try:
        return _converted(source, known, wanted)
    except CvBridgeError as error:
        raise RuntimeError(
            f"cv_bridge.cvtColorForDisplay() while trying to convert image from '{encoding_in}' to '{wanted}' "
            f"an exception was thrown ({error})"
        ) from error


def _guessed(encoding: str) -> str:
    """Return bgr8, the default output encoding. Raise RuntimeError if an image in ``encoding`` cannot be displayed."""
    bits = 0
    try:
        number = type_of_encoding(encoding)
        bits = int(list(DEPTHS)[number % 8][:-1])
    except ValueError:
        number = 0
    if bits not in ((8, 16, 32) if number < 8 else (8, 16)):
        raise RuntimeError("cv_bridge.cvtColorForDisplay() output encoding is empty and cannot be guessed.")
    return "bgr8"


def _labels(image: Pixels) -> Pixels:
    """Convert an image of class labels to a color image."""
    import numpy as np

    colors = np.frombuffer(_LABEL_COLORS, np.uint8).reshape(-1, 3)[:, ::-1]
    result: Pixels = colors[image % len(colors)]
    result[image < 0] = 0
    return result


def _scaled(image: Pixels, low: float, high: float) -> Pixels:
    """Scale an image to 8 bits: map ``low`` to 0, ``high`` to 255, and NaN to 0."""
    import numpy as np

    values = image.astype(np.float64) - low
    if image.dtype.kind != "f":
        # Like OpenCV, subtract in the image's data type.
        limits = np.iinfo(image.dtype)
        values = np.clip(np.rint(values), limits.min, limits.max)
    # Like OpenCV, multiply in float32, or in float64 for these two types.
    exact = np.dtype(np.float64 if image.dtype.name in ("int32", "float64") else np.float32)
    shown = np.rint(values.astype(exact) * exact.type(255.0 / (high - low)))
    scaled: Pixels = np.clip(np.nan_to_num(shown, nan=0.0), 0, 255).astype(np.uint8)
    return scaled
