"""rospy.rostime, filled in by minirospy."""

from minirospy.client.core import (
    get_rostime_cond,
    is_rostime_initialized,
    is_wallclock,
    set_rostime_initialized,
    switch_to_wallclock,
    wallsleep,
)
from minirospy.client.core import set_rostime as _set_rostime
from minirospy.client.time import Duration, Time, get_rostime, get_time
from rospy.impl.live import live_names as _live_names

__all__ = [
    "Duration", "Time", "get_rostime", "get_rostime_cond", "get_time", "is_rostime_initialized", "is_wallclock",
    "set_rostime_initialized", "switch_to_wallclock", "wallsleep",
]  # fmt: skip

_live_names(
    __name__,
    _rostime_initialized=(is_rostime_initialized, set_rostime_initialized),
    _rostime_current=(lambda: None if is_wallclock() else get_rostime(), _set_rostime),
)
