"""smach.iterator, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.iterator import Iterator

__all__ = [
    "Iterator",
]
