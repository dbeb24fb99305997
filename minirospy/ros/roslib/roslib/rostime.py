"""roslib.rostime: genpy's names, in their former module."""

from minirospy.base.times import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]
