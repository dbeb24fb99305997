"""rosbag: bags, read and written, and migrated to newer message types. Source: http://wiki.ros.org/rosbag/Code%20API."""

from __future__ import annotations

from minirospy.compat.rosbag.bag import (
    Bag,
    Compression,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
)

__all__ = ["Bag", "Compression", "ROSBagException", "ROSBagFormatException", "ROSBagUnindexedException"]
