"""The names of rospy.timer."""

from minirospy.client.time import Rate, Timer, TimerEvent, sleep
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["Rate", "Timer", "TimerEvent", "sleep"]

__getattr__ = modules_on_first_use("rospy.timer", "genpy rospy threading time")
