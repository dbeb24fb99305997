"""roslib.scriptutil, filled in by minirospy: the master as scripts of old ask for it."""

from __future__ import annotations

from rosgraph.masterapi import Master
from rosgraph.names import script_resolve_name

__all__ = ["get_master", "get_param_server", "script_resolve_name"]


def get_master() -> Master:
    """The master that the environment names."""
    return Master("/roslib")


get_param_server = get_master
