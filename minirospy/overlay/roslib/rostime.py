"""roslib.rostime, filled in by minirospy: genpy's names under those of old."""

from minirospy.times import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]
