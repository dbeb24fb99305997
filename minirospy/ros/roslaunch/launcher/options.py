"""The settings of a launch: the options of `roslaunch`."""

from __future__ import annotations

from dataclasses import dataclass, field

from minirospy.ros.roslaunch.launcher.process import Timeouts

__all__ = ["RunOptions"]


@dataclass(frozen=True)
class RunOptions:
    """The options for running a spec.

    ``screen``, ``log``: where all output goes, in place of the file's settings; ``log_errors``: what nodes write to standard
    error goes to their log file, too. ``required``: every node is. ``local``: nodes of other machines are not run.
    ``strict``: a node that cannot be started ends it all. ``watch``: a node whose file changes is started again.
    ``name`` is shown in the terminal's title.
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
    timeouts: Timeouts = field(default_factory=Timeouts)
    master_arguments: tuple[str, ...] = ()
