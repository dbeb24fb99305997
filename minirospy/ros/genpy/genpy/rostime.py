"""Provides the names in ROS's module genpy.rostime."""

from minirospy.base.times import Duration, Time, TVal

__all__ = ["Duration", "TVal", "Time"]
