"""rospy.rostime, provided by minirospy: the clock of the node, which a program may set."""

from minirospy.client.time import Duration, Time, get_rostime, get_time
from minirospy.ros.rospy.rospy.rostime import (
    get_rostime_cond,
    is_rostime_initialized,
    is_wallclock,
    set_rostime_initialized,
    switch_to_wallclock,
    wallsleep,
)
from minirospy.ros.rospy.rospy.rostime import set_rostime as _set_rostime  # programs without a node call it

__all__ = [
    "Duration", "Time", "get_rostime", "get_rostime_cond", "get_time", "is_rostime_initialized", "is_wallclock",
    "set_rostime_initialized", "switch_to_wallclock", "wallsleep",
]  # fmt: skip
