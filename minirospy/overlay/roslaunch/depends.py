"""roslaunch.depends, provided by minirospy: what launch files need."""

from minirospy.ros.roslaunch.commands.roslaunch_deps import main as roslaunch_deps_main
from minirospy.ros.roslaunch.roslaunch.depends import (
    NAME,
    RoslaunchDeps,
    RoslaunchDepsException,
    roslaunch_deps,
)

__all__ = ["NAME", "RoslaunchDeps", "RoslaunchDepsException", "roslaunch_deps", "roslaunch_deps_main"]
