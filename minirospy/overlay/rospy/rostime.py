"""rospy.rostime, filled in by minirospy."""

from minirospy.client.time import Duration, Time, get_rostime, get_time

__all__ = ["Duration", "Time", "get_rostime", "get_time"]
