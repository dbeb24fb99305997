"""roslaunch.rlutil, filled in by minirospy."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.compat.roslaunch.config import LaunchFile, load_config_default
from minirospy.environment import Environment
from minirospy.launch.check import faults_of
from minirospy.launch.output import Output, warn_of_large_logs
from minirospy.workspace.packages import Packages

__all__ = [
    "change_terminal_name",
    "check_log_disk_usage",
    "check_roslaunch",
    "print_file_list",
    "update_terminal_name",
]


def check_log_disk_usage() -> None:
    """Warn where the log folder holds more than a gigabyte."""
    warn_of_large_logs(Environment.read().log_dir, Output())


def check_roslaunch(f: str, use_test_depends: bool = False, ignore_unset_args: bool = False) -> str | None:
    """What is wrong with a launch file: all faults and programs that are missing, a line for each; None: nothing."""
    return "\n".join(map(str, faults_of(f, Packages(), ignore_unset_args=ignore_unset_args))) or None


def print_file_list(roslaunch_files: Sequence[LaunchFile]) -> None:
    """Print the files that launch files read."""
    print("\n".join(load_config_default(roslaunch_files, None).roslaunch_files))


def change_terminal_name(args: Sequence[str], is_core: bool) -> None:
    """Set the terminal's title to the names of the launch files."""
    Output().title("roscore" if is_core else ",".join(args))


def update_terminal_name(ros_master_uri: str) -> None:
    """Set the terminal's title to the master's URI."""
    Output().title(ros_master_uri)
