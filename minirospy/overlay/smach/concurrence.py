"""smach.concurrence, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.concurrence import Concurrence

__all__ = [
    "Concurrence",
]
