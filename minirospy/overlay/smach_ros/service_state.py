"""smach_ros.service_state, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach_ros.smach_ros.service_state import ServiceState

__all__ = [
    "ServiceState",
]
