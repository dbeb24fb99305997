"""genpy.rostime, provided by minirospy."""

from minirospy.base.times import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]
