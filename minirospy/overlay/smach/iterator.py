"""smach.iterator, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.compat.smach.iterator import (
    Iterator,
)

__all__ = [
    "Iterator",
]
