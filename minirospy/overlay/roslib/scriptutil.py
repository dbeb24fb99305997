"""roslib.scriptutil, provided by minirospy: the master, as old scripts get it."""

from rosgraph.names import script_resolve_name

from minirospy.ros.roslib.roslib.scriptutil import get_master, get_param_server

__all__ = ["get_master", "get_param_server", "script_resolve_name"]
