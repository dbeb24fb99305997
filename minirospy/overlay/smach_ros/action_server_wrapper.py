"""smach_ros.action_server_wrapper, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.compat.smach_ros.action_server_wrapper import (
    ActionServerWrapper,
)

__all__ = [
    "ActionServerWrapper",
]
