"""smach.state, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.state import CBState, State

__all__ = [
    "CBState",
    "State",
]
