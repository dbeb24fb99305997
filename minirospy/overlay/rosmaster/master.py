"""rosmaster.master, provided by minirospy: a master inside a program, as tests start one."""

from minirospy.compat.rosmaster.master import Master
from minirospy.environment import DEFAULT_MASTER_PORT

__all__ = ["DEFAULT_MASTER_PORT", "Master"]
