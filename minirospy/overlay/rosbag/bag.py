"""rosbag.bag, provided by minirospy: bags that programs read and write."""

from minirospy.compat.rosbag.bag import (
    Bag,
    BagMessage,
    BagMessageWithConnectionHeader,
    Compression,
    ROSBagEncryptException,
    ROSBagEncryptNotSupportedException,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
    found_lz4,
)

__all__ = [
    "Bag", "BagMessage", "BagMessageWithConnectionHeader", "Compression", "ROSBagEncryptException",
    "ROSBagEncryptNotSupportedException", "ROSBagException", "ROSBagFormatException", "ROSBagUnindexedException",
    "found_lz4",
]  # fmt: skip
from minirospy.compat.rosbag.internals import _ConnectionInfo as _ConnectionInfo
from minirospy.compat.rosbag.internals import _get_message_type as _get_message_type
