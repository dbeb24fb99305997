"""genmsg.srvs, provided by minirospy: the spec of a service."""

from minirospy.ros.genmsg.genmsg.srvs import SrvSpec

__all__ = ["SrvSpec"]
