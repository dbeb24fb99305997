"""smach_ros.simple_action_state, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach_ros.smach_ros.simple_action_state import SimpleActionState

__all__ = [
    "SimpleActionState",
]
