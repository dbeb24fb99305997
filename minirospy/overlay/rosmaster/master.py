"""rosmaster.master, provided by minirospy: a master inside a program, as tests start one."""

from minirospy.base.environment import DEFAULT_MASTER_PORT
from minirospy.ros.rosmaster.rosmaster.master import Master

__all__ = ["DEFAULT_MASTER_PORT", "Master"]
