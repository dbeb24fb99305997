"""cv_bridge: converts image messages to numpy arrays and back. Source: http://wiki.ros.org/cv_bridge."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.core.images.encodings import type_of_encoding
from minirospy.ros.cv_bridge.cv_bridge.core import CvBridge, CvBridgeError
from minirospy.ros.cv_bridge.display import cvtColorForDisplay

if TYPE_CHECKING:
    from minirospy.ros.cv_bridge.cv_bridge import core as core

__all__ = ["CvBridge", "CvBridgeError", "cvtColorForDisplay", "getCvType"]


def getCvType(encoding: str) -> int:
    """Return an encoding's OpenCV type number, such as 16 (CV_8UC3). Raise RuntimeError if the encoding is unknown."""
    try:
        return type_of_encoding(encoding)
    except ValueError as error:
        raise RuntimeError(str(error)) from error
