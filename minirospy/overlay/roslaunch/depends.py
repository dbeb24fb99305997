"""roslaunch.depends, provided by minirospy: what launch files need."""

from minirospy.cli.ros.roslaunch_deps import main as roslaunch_deps_main
from minirospy.compat.roslaunch.depends import NAME, RoslaunchDeps, RoslaunchDepsException, roslaunch_deps

__all__ = ["NAME", "RoslaunchDeps", "RoslaunchDepsException", "roslaunch_deps", "roslaunch_deps_main"]
