"""rosmaster.exceptions, provided by minirospy: its errors."""

from minirospy.compat.rosmaster.exceptions import (
    InternalException,
)

__all__ = [
    "InternalException",
]
