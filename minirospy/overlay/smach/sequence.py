"""smach.sequence, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.compat.smach.sequence import (
    Sequence,
)

__all__ = [
    "Sequence",
]
