"""rosmaster.threadpool, provided by minirospy: threads for calls to nodes."""

from minirospy.ros.rosmaster.rosmaster.threadpool import MarkedThreadPool

__all__ = ["MarkedThreadPool"]
