"""Provides the names in ROS's module rospy.timer."""

from minirospy.client.time import Rate, Timer, TimerEvent, sleep

__all__ = ["Rate", "Timer", "TimerEvent", "sleep"]
