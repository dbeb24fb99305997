"""rosmaster, provided by minirospy: a master inside a program. Source: http://wiki.ros.org/rosmaster."""

from minirospy.ros.rosmaster.rosmaster import __getattr__ as __getattr__
from minirospy.ros.rosmaster.rosmaster import rosmaster_main
from rosmaster import master as master
from rosmaster.master import DEFAULT_MASTER_PORT

__all__ = ["DEFAULT_MASTER_PORT", "rosmaster_main"]
