"""smach_ros.util, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach_ros.smach_ros.util import set_preempt_handler

__all__ = [
    "set_preempt_handler",
]
