"""roslaunch.rlutil: roslaunch's checks, terminal titles and arguments."""

from __future__ import annotations

import time
import uuid
from collections.abc import Sequence

from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, MinirospyError, RpcError
from minirospy.ros.roslaunch.launcher.check import faults_of
from minirospy.ros.roslaunch.launcher.files import find_files
from minirospy.ros.roslaunch.launcher.master import LaunchMaster
from minirospy.ros.roslaunch.launcher.output import Output, warn_of_large_logs
from minirospy.ros.roslaunch.roslaunch.config import LaunchFile, load_config_default
from minirospy.ros.roslaunch.roslaunch.core import RLException
from minirospy.ros.roslaunch.roslaunch.substitution_args import chosen_packages
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = [
    "_wait_for_master",
    "change_terminal_name",
    "check_log_disk_usage",
    "check_roslaunch",
    "get_or_generate_uuid",
    "print_file_list",
    "resolve_launch_arguments",
    "update_terminal_name",
]


def check_log_disk_usage() -> None:
    """Warn if the log folder exceeds one gigabyte."""
    warn_of_large_logs(Environment.read().log_dir, Output())


def check_roslaunch(f: str, use_test_depends: bool = False, ignore_unset_args: bool = False) -> str | None:
    """Return a launch file's errors, one per line, including missing programs, or None if there are none."""
    return "\n".join(map(str, faults_of(f, chosen_packages(), ignore_unset_args=ignore_unset_args))) or None


def print_file_list(roslaunch_files: Sequence[LaunchFile]) -> None:
    """Print the files read when loading these launch files."""
    print("\n".join(load_config_default(roslaunch_files, None).roslaunch_files))


def change_terminal_name(args: Sequence[str], is_core: bool) -> None:
    """Set the terminal's title to the launch files' names."""
    Output().title("roscore" if is_core else ",".join(args))


def update_terminal_name(ros_master_uri: str) -> None:
    """Set the terminal's title to the master's URI."""
    Output().title(ros_master_uri)


def get_or_generate_uuid(options_runid: str | None, options_wait_for_master: bool) -> str:
    """Return the given run id, else the master's, else a new one if no master responds."""
    if options_runid:
        return options_runid
    master = MasterProxy(Environment.read().master_uri, "/roslaunch")
    try:
        return str(master.get_param("/run_id"))
    except (MasterUnreachableError, RpcError):
        return str(uuid.uuid1())
    finally:
        master.close()


def resolve_launch_arguments(args: Sequence[str]) -> list[str]:
    """Return the paths of a command line's launch files, given as a package and a file, or as files.

    Raise RLException if a file is not found.
    """
    try:
        return find_files([word for word in args if ":=" not in word], chosen_packages())
    except MinirospyError as error:
        raise RLException(str(error)) from error


def _wait_for_master() -> None:
    """Wait until the master at ROS_MASTER_URI responds."""
    master = LaunchMaster(Environment.read(), Output(), time.sleep)
    try:
        if not master.is_online():
            master.wait()
    finally:
        master.close()
