"""smach_ros.service_state, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.compat.smach_ros.service_state import (
    ServiceState,
)

__all__ = [
    "ServiceState",
]
