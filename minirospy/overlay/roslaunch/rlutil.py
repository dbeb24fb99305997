"""roslaunch.rlutil, provided by minirospy."""

from minirospy.ros.roslaunch.roslaunch.rlutil import (
    change_terminal_name,
    check_log_disk_usage,
    check_roslaunch,
    get_or_generate_uuid,
    print_file_list,
    resolve_launch_arguments,
    update_terminal_name,
)

__all__ = [
    "change_terminal_name",
    "check_log_disk_usage",
    "check_roslaunch",
    "get_or_generate_uuid",
    "print_file_list",
    "resolve_launch_arguments",
    "update_terminal_name",
]
from minirospy.ros.roslaunch.roslaunch.rlutil import _wait_for_master as _wait_for_master
