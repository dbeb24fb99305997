"""genpy.rostime, filled in by minirospy."""

from minirospy.times import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]
