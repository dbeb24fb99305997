"""rosgraph.xmlrpc, provided by minirospy: an XML-RPC server in a thread, for tools that are nodes by hand."""

from xmlrpc.server import SimpleXMLRPCRequestHandler as SimpleXMLRPCRequestHandler
from xmlrpc.server import SimpleXMLRPCServer as SimpleXMLRPCServer

from minirospy.ros.ros_names import isstring
from minirospy.ros.rosgraph.rosgraph.xmlrpc import (
    SilenceableXMLRPCRequestHandler,
    ThreadingXMLRPCServer,
    XmlRpcHandler,
    XmlRpcNode,
)

__all__ = [
    "SilenceableXMLRPCRequestHandler",
    "ThreadingXMLRPCServer",
    "XmlRpcHandler",
    "XmlRpcNode",
    "isstring",
]
