"""rosbag, provided by minirospy: bags, read and written. Source: http://wiki.ros.org/rosbag/Code%20API."""

from minirospy.ros.rosbag.rosbag import (
    Bag,
    Compression,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
    rosbagmain,
)
from minirospy.ros.rosbag.rosbag import __getattr__ as __getattr__

__all__ = [
    "Bag", "Compression", "ROSBagException", "ROSBagFormatException", "ROSBagUnindexedException", "rosbagmain",
]  # fmt: skip
