"""cv_bridge.boost.cv_bridge_boost: encoding types and color conversions, independent of CvBridge."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.ros.cv_bridge.cv_bridge import getCvType
from minirospy.ros.cv_bridge.cv_bridge.core import CvBridgeError, _converted
from minirospy.ros.cv_bridge.display import cvtColorForDisplay

if TYPE_CHECKING:
    from minirospy.core.images.encodings import Pixels

__all__ = ["CV_MAT_CNWrap", "CV_MAT_DEPTHWrap", "cvtColor2", "cvtColorForDisplay", "getCvType"]


def CV_MAT_CNWrap(i: int) -> int:
    """Return the number of channels in an OpenCV type number."""
    return i // 8 + 1


def CV_MAT_DEPTHWrap(i: int) -> int:
    """Return the depth code in an OpenCV type number: 0 for 8U, 5 for 32F."""
    return i % 8


def cvtColor2(obj_in: Pixels, encoding_in: str, encoding_out: str) -> Pixels:
    """Convert an image to another encoding. Raise RuntimeError if there is no such conversion."""
    try:
        return _converted(obj_in, encoding_in, encoding_out)
    except CvBridgeError as error:
        raise RuntimeError(str(error)) from error
