"""roslib.exceptions, provided by minirospy."""

from minirospy.compat.roslib.exceptions import ROSLibException

__all__ = ["ROSLibException"]
