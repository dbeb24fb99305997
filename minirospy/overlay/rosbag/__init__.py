"""rosbag, provided by minirospy: bags, read and written. Source: http://wiki.ros.org/rosbag/Code%20API."""

from minirospy.compat.rosbag import (
    Bag,
    Compression,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
    rosbagmain,
)
from minirospy.compat.rosbag import __getattr__ as __getattr__

__all__ = [
    "Bag", "Compression", "ROSBagException", "ROSBagFormatException", "ROSBagUnindexedException", "rosbagmain",
]  # fmt: skip
