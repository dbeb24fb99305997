"""tf2_py: the transform buffer. Source: http://wiki.ros.org/tf2_py."""

from minirospy.base.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from minirospy.ros.tf2_ros.tf2_ros.core import BufferCore

__all__ = [
    "BufferCore",
    "ConnectivityException",
    "ExtrapolationException",
    "InvalidArgumentException",
    "LookupException",
    "TimeoutException",
    "TransformException",
]
