"""rospy.timer, provided by minirospy."""

from minirospy.client.time import Rate, Timer, TimerEvent, sleep

__all__ = ["Rate", "Timer", "TimerEvent", "sleep"]
