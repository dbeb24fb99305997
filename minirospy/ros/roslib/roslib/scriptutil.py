"""roslib.scriptutil: provides the master proxy that old scripts use."""

from __future__ import annotations

from xmlrpc.client import ServerProxy

from minirospy.ros.rosgraph.rosgraph.names import script_resolve_name
from minirospy.ros.rosgraph.rosgraph.rosenv import get_master_uri

__all__ = ["get_master", "get_param_server", "script_resolve_name"]


def get_master() -> ServerProxy:
    """Return a proxy for the master that the environment specifies.

    Each method's first argument is the caller id; each returns (code, status message, value).
    """
    return ServerProxy(get_master_uri())


get_param_server = get_master
