"""smach.state_machine, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.state_machine import StateMachine

__all__ = [
    "StateMachine",
]
