"""roslib.gentools, provided by minirospy: md5sums and full texts."""

from minirospy.ros.roslib.roslib.gentools import (
    MsgSpecException,
    compute_full_text,
    compute_md5,
    compute_md5_text,
    get_dependencies,
    get_file_dependencies,
)

__all__ = [
    "MsgSpecException",
    "compute_full_text",
    "compute_md5",
    "compute_md5_text",
    "get_dependencies",
    "get_file_dependencies",
]
