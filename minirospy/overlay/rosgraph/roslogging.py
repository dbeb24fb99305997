"""rosgraph.roslogging, filled in by minirospy: the handler that a logging configuration file names."""

from minirospy.client.log import RosStreamHandler

__all__ = ["RosStreamHandler"]
