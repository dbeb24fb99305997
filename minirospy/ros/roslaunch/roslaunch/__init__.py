"""roslaunch's Python API. Source: http://wiki.ros.org/roslaunch/API%20Usage."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from minirospy.base.environment import DEFAULT_MASTER_PORT
from minirospy.base.private_files import open_text

if TYPE_CHECKING:
    import logging

    from minirospy.ros.roslaunch.roslaunch import arg_dump as arg_dump
    from minirospy.ros.roslaunch.roslaunch import config as config
    from minirospy.ros.roslaunch.roslaunch import core as core
    from minirospy.ros.roslaunch.roslaunch import core as roslaunch_core
    from minirospy.ros.roslaunch.roslaunch import depends as depends
    from minirospy.ros.roslaunch.roslaunch import launch as launch
    from minirospy.ros.roslaunch.roslaunch import loader as loader
    from minirospy.ros.roslaunch.roslaunch import node_args as node_args
    from minirospy.ros.roslaunch.roslaunch import nodeprocess as nodeprocess
    from minirospy.ros.roslaunch.roslaunch import param_dump as param_dump
    from minirospy.ros.roslaunch.roslaunch import parent as parent
    from minirospy.ros.roslaunch.roslaunch import pmon as pmon
    from minirospy.ros.roslaunch.roslaunch import rlutil as rlutil
    from minirospy.ros.roslaunch.roslaunch import scriptapi as scriptapi
    from minirospy.ros.roslaunch.roslaunch import server as server
    from minirospy.ros.roslaunch.roslaunch import substitution_args as substitution_args
    from minirospy.ros.roslaunch.roslaunch import xmlloader as xmlloader
    from minirospy.ros.roslaunch.roslaunch.config import ROSLaunchConfig
    from minirospy.ros.roslaunch.roslaunch.core import Master, Node, RLException, Test
    from minirospy.ros.roslaunch.roslaunch.launch import ROSLaunchRunner
    from minirospy.ros.roslaunch.roslaunch.pmon import Process
    from minirospy.ros.roslaunch.roslaunch.scriptapi import ROSLaunch
    from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlLoader, XmlParseException

__all__ = [
    "DEFAULT_MASTER_PORT",
    "NAME",
    "Master",
    "Node",
    "Process",
    "RLException",
    "ROSLaunch",
    "ROSLaunchConfig",
    "ROSLaunchRunner",
    "Test",
    "XmlLoader",
    "XmlParseException",
    "configure_logging",
    "handle_exception",
    "main",
    "roslaunch_core",
    "write_pid_file",
]

NAME = "roslaunch"


def configure_logging(uuid: str) -> None:
    """Do nothing; accepted for compatibility. roslaunch always logs to roslaunch-HOST-PID.log in the run's folder."""


def write_pid_file(options_pid_fn: str | None, options_core: bool, port: int | None) -> None:
    """Write the process id to the given file. For a core, the default is roscore-PORT.pid in ROS_HOME."""
    if not options_pid_fn and options_core:
        home = os.environ.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
        options_pid_fn = os.path.join(home, f"roscore-{port or DEFAULT_MASTER_PORT}.pid")
    if options_pid_fn:
        with open_text(Path(options_pid_fn).expanduser(), "w") as file:
            file.write(str(os.getpid()))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command ``roslaunch``; return its exit status. ``argv`` starts with the command's name."""
    from minirospy.ros.roslaunch.commands import roslaunch

    return roslaunch.main(None if argv is None else argv[1:])


def handle_exception(
    roslaunch_core: Any, logger: logging.Logger | None, msg: str, e: BaseException
) -> NoReturn:
    """Print an error to stderr, log its traceback and exit."""
    import traceback

    roslaunch_core.printerrlog(msg + str(e))
    roslaunch_core.printerrlog("The traceback for the exception was written to the log file")
    if logger:
        logger.error(traceback.format_exc())
    sys.exit(1)
