"""genmsg.srvs, filled in by minirospy."""

from minirospy.compat.genmsg.srvs import SrvSpec

__all__ = ["SrvSpec"]
