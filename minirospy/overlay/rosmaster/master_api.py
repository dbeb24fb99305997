"""rosmaster.master_api, provided by minirospy: the Master API as an object."""

from minirospy.ros.rosmaster.rosmaster.master_api import (
    LOG_API,
    MSG,
    NUM_WORKERS,
    STATUS,
    VAL,
    ROSMasterHandler,
)

__all__ = [
    "LOG_API",
    "MSG",
    "NUM_WORKERS",
    "STATUS",
    "VAL",
    "ROSMasterHandler",
]
