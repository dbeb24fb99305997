"""rosmaster.exceptions, provided by minirospy: its errors."""

from minirospy.ros.rosmaster.rosmaster.exceptions import InternalException

__all__ = [
    "InternalException",
]
