"""roslaunch, filled in by minirospy. Source: http://wiki.ros.org/roslaunch/API%20Usage."""

from __future__ import annotations

import os
from collections.abc import Sequence

from minirospy.environment import DEFAULT_MASTER_PORT
from minirospy.launch.config import (
    Master,
    Node,
    RLException,
    ROSLaunchConfig,
    Test,
    XmlLoader,
    XmlParseException,
)
from minirospy.launch.monitor import Process
from minirospy.launch.parent import ROSLaunch, ROSLaunchRunner
from roslaunch import arg_dump as arg_dump
from roslaunch import config as config
from roslaunch import core as core
from roslaunch import core as roslaunch_core
from roslaunch import depends as depends
from roslaunch import launch as launch
from roslaunch import loader as loader
from roslaunch import node_args as node_args
from roslaunch import nodeprocess as nodeprocess
from roslaunch import param_dump as param_dump
from roslaunch import parent as parent
from roslaunch import pmon as pmon
from roslaunch import rlutil as rlutil
from roslaunch import scriptapi as scriptapi
from roslaunch import server as server
from roslaunch import substitution_args as substitution_args
from roslaunch import xmlloader as xmlloader

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
    "main",
    "roslaunch_core",
    "write_pid_file",
]

NAME = "roslaunch"


def configure_logging(uuid: str) -> None:
    """Nothing is left to do: what roslaunch says goes into roslaunch-HOST-PID.log of the run's folder by itself."""


def write_pid_file(options_pid_fn: str | None, options_core: bool, port: int | None) -> None:
    """Write the process id to a file; of a core, where none is named, to roscore-PORT.pid in ROS_HOME."""
    if not options_pid_fn and options_core:
        home = os.environ.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
        options_pid_fn = os.path.join(home, f"roscore-{port or DEFAULT_MASTER_PORT}.pid")
    if options_pid_fn:
        with open(os.path.expanduser(options_pid_fn), "w", encoding="utf-8") as file:
            file.write(str(os.getpid()))


def main(argv: Sequence[str] | None = None) -> int:
    """The command ``roslaunch``; ``argv`` with the command's name in front."""
    from minirospy.cli.ros import roslaunch

    return roslaunch.main(None if argv is None else argv[1:])
