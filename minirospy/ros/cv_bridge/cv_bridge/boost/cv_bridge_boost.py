"""cv_bridge.boost.cv_bridge_boost: types of encodings and conversions of colors, without CvBridge around them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.ros.cv_bridge.cv_bridge import getCvType
from minirospy.ros.cv_bridge.cv_bridge.core import CvBridgeError, _converted

if TYPE_CHECKING:
    from minirospy.core.images.encodings import Pixels

__all__ = ["CV_MAT_CNWrap", "CV_MAT_DEPTHWrap", "cvtColor2", "getCvType"]


def CV_MAT_CNWrap(i: int) -> int:
    """Return the number of channels of OpenCV's number of a type."""
    return i // 8 + 1


def CV_MAT_DEPTHWrap(i: int) -> int:
    """Return the depth of OpenCV's number of a type: 0 for 8U, 5 for 32F."""
    return i % 8


def cvtColor2(obj_in: Pixels, encoding_in: str, encoding_out: str) -> Pixels:
    """Return an image in another encoding. Raise RuntimeError if there is no such conversion."""
    try:
        return _converted(obj_in, encoding_in, encoding_out)
    except CvBridgeError as error:
        raise RuntimeError(str(error)) from error
