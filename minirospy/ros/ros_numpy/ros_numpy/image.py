"""ros_numpy.image: converts images to arrays (height, width) or (height, width, channels), and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from sensor_msgs.msg import Image

from minirospy.ros.cv_bridge.cv_bridge.core import CvBridge, CvBridgeError
from minirospy.ros.ros_numpy.ros_numpy.registry import converts_from_numpy, converts_to_numpy

if TYPE_CHECKING:
    from minirospy.ros.ros_numpy.ros_numpy.registry import Array

__all__ = ["image_to_numpy", "numpy_to_image"]


@converts_to_numpy(Image)
def image_to_numpy(msg: Image) -> Array:
    """Convert an image to an array, which is a read-only view of the message if the byte order is native.

    Raise TypeError if the image cannot be converted.
    """
    return CvBridge().imgmsg_to_cv2(msg)


@converts_from_numpy(Image)
def numpy_to_image(arr: Array, encoding: str) -> Image:
    """Convert an array to an image with this encoding. Raise TypeError if the array's type does not match."""
    dtype, channels = CvBridge().encoding_to_dtype_with_channels(encoding)
    if arr.ndim not in (2, 3):
        raise TypeError("Array must be two or three dimensional")
    given = arr.shape[2] if arr.ndim == 3 else 1
    if given != channels:
        raise CvBridgeError(f"Array has {given} channels, {encoding} requires {channels}")
    if arr.dtype.newbyteorder("=") != np.dtype(dtype):
        raise CvBridgeError(f"Array is {arr.dtype.name}, {encoding} requires {dtype}")
    return CvBridge().cv2_to_imgmsg(arr, encoding)
