"""A table of rqt's windows and RViz. Each is a command, an rqt plugin with its view, and a ROS package. Pure.

The build writes the packages (`rosrun rqt_plot rqt_plot`, `rospack find rqt_plot`) into ``ros/``, as it does for messages.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

__all__ = ["WINDOWS", "Window", "view_of_plugin", "write_packages"]

_MANIFEST = """<?xml version="1.0"?>
<package format="2">
  <name>{package}</name>
  <version>{version}</version>
  <description>{description}</description>
  <maintainer email="maintainers@minirospy.invalid">minirospy</maintainer>
  <license>BSD</license>
</package>
"""
_PROGRAM = '''#!/usr/bin/env python3
"""`rosrun {package} {program}`; see docs/dashboard.md."""

import sys

from minirospy.cli.dashboard import {command}

if __name__ == "__main__":
    sys.exit({command}())
'''


class Window(NamedTuple):
    """A command that opens a view of the dashboard."""

    command: str
    view: str
    what: str  # what the command does; its help appends "in a browser"
    version: str  # the ROS package's version
    description: str  # the ROS package's description
    package: str = ""  # the ROS package's name, if it differs from the command
    # the names of the package's programs, if they differ from the package name
    programs: tuple[str, ...] = ()


WINDOWS = (
    Window("rqt", "topics", "Shows the graph", "0.5.3", "The dashboard in a browser.", package="rqt_gui"),
    Window("rqt_bag", "bag", "Records topics, and shows and plays bags", "0.4.13",
           "Bags: recorded, shown on a timeline and played, in a browser."),
    Window("rqt_console", "console", "Shows the log lines of all nodes", "0.4.12",
           "The log lines of all nodes, in a browser."),
    Window("rqt_controller_manager", "controllers", "Shows, starts and stops controllers", "0.20.0",
           "Controllers of ros_control: shown, loaded, started and stopped, in a browser."),
    Window("rqt_graph", "graph", "Shows nodes and topics", "0.4.14", "Nodes and topics, in a browser."),
    Window("rqt_image_view", "image", "Shows images of a topic", "0.4.17", "Images of topics, in a browser."),
    Window("rqt_joint_trajectory_controller", "trajectory", "Moves the joints of a controller", "0.21.2",
           "Sliders that move the joints of a JointTrajectoryController, in a browser."),
    Window("rqt_launch", "launch", "Starts launch files, and shows their nodes", "0.4.13",
           "Launch files: started and watched, in a browser."),
    Window("rqt_logger_level", "console", "Shows log lines, and sets the levels of loggers", "0.4.13",
           "Levels of loggers, in a browser."),
    Window("rqt_plot", "plot", "Plots numbers of messages", "0.4.13", "Plots of numbers of messages, in a browser."),
    Window("rqt_publisher", "publish", "Publishes messages by forms", "0.4.13",
           "Forms that publish messages, in a browser."),
    Window("rqt_reconfigure", "reconfigure", "Changes parameters of running nodes", "0.4.13",
           "Parameters of dynamic_reconfigure servers, in a browser."),
    Window("rqt_robot_monitor", "diagnostics", "Shows aggregated diagnostics as a tree", "0.4.13",
           "Aggregated diagnostics as a tree, in a browser."),
    Window("rqt_robot_steering", "teleop", "Drives a robot", "0.4.13", "A stick that drives a robot, in a browser."),
    Window("rqt_runtime_monitor", "diagnostics", "Shows diagnostics", "0.4.13",
           "Diagnostics as a list, in a browser."),
    Window("rqt_service_caller", "services", "Calls services by forms", "0.4.13",
           "Forms that call services, in a browser."),
    Window("rqt_tf_tree", "tf", "Shows the tree of frames", "0.4.13", "The tree of frames with rates, in a browser."),
    Window("rqt_top", "nodes", "Shows CPU and memory of nodes", "0.4.10", "CPU and memory of nodes, in a browser."),
    Window("rqt_topic", "topics", "Shows topics with their values", "0.4.13", "Topics with their values, in a browser."),
    Window("rviz", "3d", "Shows robots, sensors and maps in three dimensions", "1.14.19",
           "Robots, sensors and maps in three dimensions, in a browser."),
    Window("smach_viewer", "smach", "Shows state machines", "0.4.13", "State machines of smach, in a browser.",
           programs=("smach_viewer", "smach_viewer.py")),
)  # fmt: skip
"""The table. To add a window, add a row here, its arguments (if any) in dashboard.py, and run ``python tools/commands.py``."""


def view_of_plugin(plugin: str) -> str:
    """Return the view for the plugin name given to `rqt --standalone`. Raise UsageError if there is none."""
    # Import this here to keep start-up fast: every command imports this module.
    from minirospy.base.errors import UsageError
    from minirospy.web.dashboard.views import VIEWS

    plugins = {each.command: each.view for each in WINDOWS if each.command.startswith("rqt_")}
    name = plugin.rpartition("/")[0] or plugin
    for known, view in plugins.items():
        # rqt also accepts part of a plugin's name.
        if name.lower().replace(".", "/").split("/")[0] == known:
            return view
    if name in VIEWS:
        return name
    raise UsageError(f"there is no view for the plug-in '{plugin}': there are {', '.join(plugins)}")


def write_packages(folder: Path) -> list[str]:
    """Write the ROS package of each window into ``folder``; return the packages' names."""
    from xml.sax.saxutils import escape

    names = []
    for window in WINDOWS:
        package = window.package or window.command
        names.append(package)
        scripts = folder / package / "scripts"
        scripts.mkdir(parents=True, exist_ok=True)
        manifest = _MANIFEST.format(
            package=package, version=window.version, description=escape(window.description)
        )
        (folder / package / "package.xml").write_text(manifest, encoding="utf-8", newline="\n")
        for program in window.programs or (package,):
            text = _PROGRAM.format(package=package, program=program, command=window.command)
            (scripts / program).write_text(text, encoding="utf-8", newline="\n")
            (scripts / program).chmod(0o755)
    return names
