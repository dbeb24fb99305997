"""rosbag.bag, provided by minirospy: bags that programs read and write."""

from minirospy.ros.rosbag.rosbag.bag import (
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
from minirospy.core.bag.info import _human_frequency as _human_readable_frequency
from minirospy.core.bag.info import _human_size as _human_readable_size
from minirospy.ros.rosbag.rosbag.internals import _ChunkHeader as _ChunkHeader
from minirospy.ros.rosbag.rosbag.internals import _ChunkInfo as _ChunkInfo
from minirospy.ros.rosbag.rosbag.internals import _ConnectionInfo as _ConnectionInfo
from minirospy.ros.rosbag.rosbag.internals import _get_message_type as _get_message_type
from minirospy.ros.rosbag.rosbag.internals import _IndexEntry as _IndexEntry
from minirospy.ros.rosbag.rosbag.internals import _message_types as _message_types
from minirospy.ros.rosbag.rosbag.readers import _BagReader as _BagReader
from minirospy.ros.rosbag.rosbag.readers import _BagReader200 as _BagReader200
