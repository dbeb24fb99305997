"""smach_ros.monitor_state, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach_ros.smach_ros.monitor_state import MonitorState

__all__ = [
    "MonitorState",
]
