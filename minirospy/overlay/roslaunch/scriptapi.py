"""roslaunch.scriptapi, provided by minirospy: start nodes one by one from a program."""

from minirospy.ros.roslaunch.roslaunch.core import Master, Node, RLException
from minirospy.ros.roslaunch.roslaunch.scriptapi import ROSLaunch

__all__ = ["Master", "Node", "RLException", "ROSLaunch"]
