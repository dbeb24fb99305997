"""rosbag.rosbag_main, provided by minirospy: the verbs of the command as functions."""

from minirospy.ros.rosbag.rosbag.rosbag_main import (
    check_cmd,
    compress_cmd,
    decompress_cmd,
    filter_cmd,
    fix_cmd,
    info_cmd,
    play_cmd,
    record_cmd,
    reindex_cmd,
    rosbagmain,
)

__all__ = [
    "check_cmd",
    "compress_cmd",
    "decompress_cmd",
    "filter_cmd",
    "fix_cmd",
    "info_cmd",
    "play_cmd",
    "record_cmd",
    "reindex_cmd",
    "rosbagmain",
]
