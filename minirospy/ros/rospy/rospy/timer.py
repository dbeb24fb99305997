"""The names of rospy.timer."""

from minirospy.client.time import Rate, Timer, TimerEvent, sleep

__all__ = ["Rate", "Timer", "TimerEvent", "sleep"]
