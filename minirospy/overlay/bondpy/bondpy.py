"""bondpy.bondpy, provided by minirospy. Source: http://wiki.ros.org/bondpy."""

from minirospy.ros.bondpy.bondpy.bondpy import Bond, Timeout, as_float_duration, as_ros_duration

__all__ = [
    "Bond",
    "Timeout",
    "as_float_duration",
    "as_ros_duration",
]
