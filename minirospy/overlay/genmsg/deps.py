"""genmsg.deps, provided by minirospy: the files that a definition needs."""

from minirospy.ros.genmsg.genmsg.deps import (
    find_msg_dependencies,
    find_msg_dependencies_with_type,
    find_srv_dependencies,
    find_srv_dependencies_with_type,
)

__all__ = [
    "find_msg_dependencies",
    "find_msg_dependencies_with_type",
    "find_srv_dependencies",
    "find_srv_dependencies_with_type",
]
