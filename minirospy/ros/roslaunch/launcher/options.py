"""The settings of a launch, from the options of `roslaunch`."""

from __future__ import annotations

from dataclasses import dataclass, field

from minirospy.ros.roslaunch.launcher.process import Timeouts

__all__ = ["RunOptions"]


@dataclass(frozen=True)
class RunOptions:
    """The options for running a spec.

    ``screen``, ``log``: send the output of all nodes to the screen or to log files, regardless of the launch file;
    ``log_errors``: also log the nodes' stderr. ``required``: treat every node as required. ``local``: skip the nodes of other
    machines. ``strict``: stop the launch if a node cannot be started. ``watch``: restart a node if its files change.
    ``name`` is shown in the terminal's title. ``inherit_stdin``: nodes inherit this process's stdin (for example the
    keyboard), as in ROS; if False, their stdin is empty.
    """

    screen: bool = False
    log: bool = False
    log_errors: bool = False
    required: bool = False
    local: bool = False
    strict: bool = False
    watch: bool = False
    summary: bool = True
    name: str = ""
    inherit_stdin: bool = False
    timeouts: Timeouts = field(default_factory=Timeouts)
    master_arguments: tuple[str, ...] = ()
