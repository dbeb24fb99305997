"""rosgraph.masterapi, provided by minirospy."""

from minirospy.ros.rosgraph.rosgraph.masterapi import (
    Error,
    Failure,
    Master,
    MasterError,
    MasterException,
    MasterFailure,
    ROSMasterException,
    is_online,
)
from minirospy.ros.rosgraph.rosgraph.names import make_caller_id as make_caller_id
from minirospy.ros.rosgraph.rosgraph.network import parse_http_host_and_port as parse_http_host_and_port
from rosgraph.rosenv import get_master_uri

__all__ = [
    "Error", "Failure", "Master", "MasterError", "MasterException", "MasterFailure", "ROSMasterException",
    "get_master_uri", "is_online",
]  # fmt: skip
