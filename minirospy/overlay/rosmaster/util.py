"""rosmaster.util, provided by minirospy: proxies of XML-RPC servers."""

from minirospy.ros.rosmaster.rosmaster.util import remove_server_proxy, xmlrpcapi

__all__ = [
    "remove_server_proxy",
    "xmlrpcapi",
]
