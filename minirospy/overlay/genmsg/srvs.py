"""genmsg.srvs, filled in by minirospy."""

from minirospy.compat.genmsg.msg_loader import SrvSpec

__all__ = ["SrvSpec"]
