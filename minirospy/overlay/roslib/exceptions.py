"""roslib.exceptions, provided by minirospy."""

from minirospy.ros.roslib.roslib.exceptions import ROSLibException

__all__ = ["ROSLibException"]
