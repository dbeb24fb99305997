"""roslib.rostime: re-exports the names that have moved to genpy."""

from minirospy.base.times import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]
