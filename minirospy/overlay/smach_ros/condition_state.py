"""smach_ros.condition_state, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.compat.smach_ros.condition_state import (
    ConditionState,
)

__all__ = [
    "ConditionState",
]
