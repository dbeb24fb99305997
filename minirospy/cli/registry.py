"""A table of all commands. The console scripts, `minirospy VERB` and completion are generated from it.

The build creates the console scripts (hatch_build.py); `python tools/commands.py` writes the lists for the shells and for the
conda recipe.

A command's module is imported when the command is started or completed.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from minirospy.cli.windows import WINDOWS

if TYPE_CHECKING:
    from minirospy.command.verbs import Command, Family

__all__ = ["COMMANDS", "SHELL_FUNCTIONS", "Entry", "console_scripts", "find_script", "find_verb"]


class Entry(NamedTuple):
    """A command's module, function and names.

    ``script`` is the console script, ``verb`` the word after `minirospy`; either may be empty. The help does not show a
    verb without a summary. ``grammar`` is the name of the Command or Family in ``module``; a command that parses its
    arguments itself has no grammar; its ``completer`` is the name of a function in minirospy.cli.completion.completers.
    """

    module: str
    function: str
    grammar: str = ""
    script: str = ""
    verb: str = ""
    summary: str = ""
    completer: str = ""

    @property
    def target(self) -> str:
        """Return the console script's function in entry-point syntax, ``module:function``."""
        return f"minirospy.{self.module}:{self.function}"

    def load_main(self) -> Callable[[Sequence[str] | None], int]:
        """Import the module and return the function that runs the command."""
        main: Callable[[Sequence[str] | None], int] = getattr(self._load_module(), self.function)
        return main

    def load_grammar(self) -> Command | Family | None:
        """Import the module and return the Command or Family that it defines, or None if it defines only a function."""
        grammar: Command | Family | None = (
            getattr(self._load_module(), self.grammar) if self.grammar else None
        )
        return grammar

    def _load_module(self) -> object:
        return importlib.import_module(f"minirospy.{self.module}")


COMMANDS = (
    Entry("cli.main", "main", script="minirospy"),
    Entry("cli.demo", "main", "COMMAND", "", "demo", "the workshop's button lights its LED, on the virtual board"),
    Entry("ros.rosmaster.commands.master", "main", "MASTER", "", "master", "start the master in the foreground (as roscore)"),
    Entry("cli.board", "main", "FAMILY", "", "board", "see the virtual board, press its buttons"),
    Entry("ros.rosbash.commands.rosrun", "main", "", "rosrun", "run", "run a package's program (as rosrun)", "rosrun_words"),
    Entry("cli.python", "main", "", "", "python", "run a file with minirospy's own Python", "files"),
    Entry("ros.roslaunch.commands.roslaunch", "main", "COMMAND", "roslaunch", "launch", "run a launch file (as roslaunch)"),
    Entry("ros.rostopic.commands.rostopic", "main", "FAMILY", "rostopic", "topic", "list, echo, publish topics (as rostopic)"),
    Entry("ros.rosnode.commands.rosnode", "main", "FAMILY", "rosnode", "node", "list, ping, stop nodes (as rosnode)"),
    Entry("ros.rosservice.commands.rosservice", "main", "FAMILY", "rosservice", "service", "list, call services (as rosservice)"),
    Entry("ros.rosparam.commands.rosparam", "main", "FAMILY", "rosparam", "param", "get, set parameters (as rosparam)"),
    Entry("ros.rosmsg.commands.rosmsg", "main", "ROSMSG", "rosmsg", "msg", "show message types (as rosmsg)"),
    Entry("ros.rosmsg.commands.rosmsg", "main_srv", "ROSSRV", "rossrv", "srv", "show service types (as rossrv)"),
    Entry("ros.rosbag.commands.rosbag", "main", "FAMILY", "rosbag", "bag", "look into, change and repair bags (as rosbag)"),
    Entry("ros.rosconsole.commands.rosconsole", "main", "FAMILY", "rosconsole", "console",
          "levels of loggers, and what nodes log (as rosconsole)"),
    Entry("ros.rosgraph.commands.rosgraph", "main", "COMMAND", "rosgraph", "graph", "who sends to whom (as rosgraph)"),
    Entry("ros.rosclean.commands.rosclean", "main", "FAMILY", "rosclean", "clean",
          "how much log files take; remove them (as rosclean)"),
    Entry("ros.rosversion.commands.rosversion", "main", "COMMAND", "rosversion", "version",
          "the version of a package or of ROS (as rosversion)"),
    Entry("ros.rospack.commands.rospack", "main", "", "rospack", "pack", "find packages and their dependencies (as rospack)",
          "rospack_words"),
    Entry("ros.rostest.commands.rostest", "rostest", "ROSTEST", "rostest", "test", "run the tests of nodes (as rostest)"),
    Entry("ros.catkin.commands.make", "catkin_make", "MAKE", "catkin_make", "make", "build a workspace (as catkin_make)"),
    Entry("cli.bridge", "main", "COMMAND", "", "bridge",
          "see the graph in Foxglove, Lichtblick and browsers"),
    Entry("cli.ros2_bridge", "main", "COMMAND", "", "ros2-bridge", "pass topics between ROS 1 and ROS 2"),
    Entry("cli.fleet", "main", "FAMILY", "", "fleet", "join robots with their own masters over Zenoh"),
    Entry("cli.dashboard", "dashboard", "DASHBOARD", "", "dashboard",
          "console, plots, graph and board in a browser (as rqt)"),
    Entry("ros.roswtf.commands.doctor", "main", "DOCTOR", "", "doctor",
          "what is wrong here, in the network, in the graph (as roswtf)"),
    Entry("cli.check", "main", "COMMAND", "", "check", "check your program for an exercise of the course"),
    Entry("cli.completion.shell", "main", "COMMAND", "", "shell", 'roscd and completion: eval "$(minirospy shell)"'),
    # Called by shells, not by users.
    Entry("cli.completion.complete", "main", "", "", "complete"),
    Entry("ros.rosmaster.commands.master", "roscore", "ROSCORE", "roscore"),
    Entry("ros.rosmaster.commands.master", "rosmaster", "ROSMASTER", "rosmaster"),
    Entry("ros.roslaunch.commands.roslaunch_deps", "main", "COMMAND", "roslaunch-deps"),
    Entry("ros.roslaunch.commands.roslaunch_logs", "main", "COMMAND", "roslaunch-logs"),
    Entry("ros.rospack.commands.rospack", "rosstack", "", "rosstack", completer="rosstack_words"),
    Entry("ros.rosdep.commands.rosdep", "main", "FAMILY", "rosdep"),
    Entry("ros.rosmsg.commands.rosmsg_proto", "main", "COMMAND", "rosmsg-proto"),
    Entry("ros.roswtf.commands.doctor", "roswtf", "ROSWTF", "roswtf"),
    *(Entry("cli.dashboard", each.command, each.command.upper(), each.command) for each in WINDOWS),
    Entry("ros.rostest.commands.rostest", "rosunit", "ROSUNIT", "rosunit"),
    Entry("ros.xacro.commands.xacro", "main", "", "xacro", completer="files"),
    Entry("ros.urdf.commands.urdf", "check_urdf", "CHECK", "check_urdf"),
    Entry("ros.urdf.commands.urdf", "urdf_to_graphviz", "GRAPHVIZ", "urdf_to_graphviz"),
    Entry("ros.urdf.commands.urdf", "urdf_to_graphiz", "GRAPHIZ", "urdf_to_graphiz"),
    Entry("ros.catkin.commands.test_results", "main", "COMMAND", "catkin_test_results"),
    Entry("ros.catkin.commands.make", "catkin_make_isolated", "MAKE_ISOLATED", "catkin_make_isolated"),
    Entry("ros.catkin.commands.tool", "catkin", "CATKIN", "catkin"),
    Entry("ros.catkin.commands.create", "catkin_create_pkg", "CREATE", "catkin_create_pkg"),
    Entry("ros.catkin.commands.create", "catkin_init_workspace", "INIT_WORKSPACE", "catkin_init_workspace"),
    Entry("ros.catkin.commands.find", "catkin_find", "FIND", "catkin_find"),
    Entry("ros.catkin.commands.find", "catkin_find_pkg", "FIND_PKG", "catkin_find_pkg"),
    Entry("ros.catkin.commands.find", "catkin_topological_order", "TOPOLOGICAL_ORDER", "catkin_topological_order"),
)  # fmt: skip
"""Verbs in the order of `minirospy -h`, followed by commands that are only console scripts."""

SHELL_FUNCTIONS = {
    "roscd": "package_folders",
    "rospd": "package_folders",
    "rosls": "package_folders",
    "rosed": "package_file",
    "roscat": "package_file",
    "roscp": "package_file_and_target",
    "rosmv": "package_file_and_target",
}
"""The functions that `minirospy shell` defines, each with the name of its completer in minirospy.cli.completion.completers."""


def console_scripts() -> dict[str, str]:
    """Return the console scripts, as a dict from name to function, for ``project.scripts`` in the package metadata."""
    return {entry.script: entry.target for entry in COMMANDS if entry.script}


def find_script(name: str) -> Entry | None:
    """Return the command with the console script ``name``, or None if there is none."""
    return next((entry for entry in COMMANDS if entry.script == name), None)


def find_verb(name: str) -> Entry | None:
    """Return the command for `minirospy NAME`, or None if there is none."""
    return next((entry for entry in COMMANDS if entry.verb == name), None)
