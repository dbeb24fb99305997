"""rosclean, provided by minirospy: how much log files take. Source: http://wiki.ros.org/rosclean."""

from minirospy.ros.rosclean.rosclean import (
    CleanupException,
    get_disk_usage,
    get_human_readable_disk_usage,
    rosclean_main,
)

__all__ = ["CleanupException", "get_disk_usage", "get_human_readable_disk_usage", "rosclean_main"]
