"""smach_ros.condition_state, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach_ros.smach_ros.condition_state import ConditionState

__all__ = [
    "ConditionState",
]
