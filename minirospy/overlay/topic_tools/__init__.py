"""topic_tools, provided by minirospy: lazy nodes; its services. Source: http://wiki.ros.org/topic_tools."""

from minirospy.ros.topic_tools.topic_tools import LazyTransport, MetaLazyTransport

__all__ = ["LazyTransport", "MetaLazyTransport"]
