"""rosbag: read, write and migrate bags. Source: http://wiki.ros.org/rosbag/Code%20API."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.ros.rosbag.rosbag.bag import (
    Bag,
    Compression,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
)

__all__ = [
    "Bag",
    "Compression",
    "ROSBagException",
    "ROSBagFormatException",
    "ROSBagUnindexedException",
    "rosbagmain",
]


def rosbagmain(argv: Sequence[str] | None = None) -> int:
    """Run the command rosbag; return its exit status. ``argv`` starts with the program's name."""
    from minirospy.ros.rosbag.commands import rosbag

    return rosbag.main((sys.argv if argv is None else argv)[1:])
