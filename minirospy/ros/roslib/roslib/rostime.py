"""roslib.rostime: re-exports genpy's names, which were in this module before."""

from minirospy.base.times import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]
