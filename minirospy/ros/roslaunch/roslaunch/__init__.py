"""roslaunch. Source: http://wiki.ros.org/roslaunch/API%20Usage."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.environment import DEFAULT_MASTER_PORT
from minirospy.base.private_files import open_text

__all__ = ["NAME", "configure_logging", "main", "write_pid_file"]

NAME = "roslaunch"


def configure_logging(uuid: str) -> None:
    """Accept ROS's call and do nothing: roslaunch always logs to roslaunch-HOST-PID.log in the folder of the run."""


def write_pid_file(options_pid_fn: str | None, options_core: bool, port: int | None) -> None:
    """Write the process id to the given file; for a core without a given file, to roscore-PORT.pid in ROS_HOME."""
    if not options_pid_fn and options_core:
        home = os.environ.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
        options_pid_fn = os.path.join(home, f"roscore-{port or DEFAULT_MASTER_PORT}.pid")
    if options_pid_fn:
        with open_text(Path(options_pid_fn).expanduser(), "w") as file:
            file.write(str(os.getpid()))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command ``roslaunch``; ``argv`` starts with its name. Return its exit status."""
    from minirospy.ros.roslaunch.commands import roslaunch

    return roslaunch.main(None if argv is None else argv[1:])
