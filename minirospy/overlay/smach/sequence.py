"""smach.sequence, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.sequence import Sequence

__all__ = [
    "Sequence",
]
