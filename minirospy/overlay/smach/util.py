"""smach.util, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.util import (
    CBInterface,
    cb_interface,
    has_smach_interface,
    is_shutdown,
    set_shutdown_check,
)

__all__ = [
    "CBInterface",
    "cb_interface",
    "has_smach_interface",
    "is_shutdown",
    "set_shutdown_check",
]
