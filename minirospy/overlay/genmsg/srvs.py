"""genmsg.srvs, filled in by minirospy."""

from minirospy.idl.genmsg import SrvSpec

__all__ = ["SrvSpec"]
