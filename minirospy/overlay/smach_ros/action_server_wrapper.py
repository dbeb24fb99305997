"""smach_ros.action_server_wrapper, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach_ros.smach_ros.action_server_wrapper import ActionServerWrapper

__all__ = [
    "ActionServerWrapper",
]
