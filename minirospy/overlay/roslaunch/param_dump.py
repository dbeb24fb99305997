"""roslaunch.param_dump, provided by minirospy."""

import yaml as yaml

from minirospy.ros.roslaunch.roslaunch.param_dump import dump_params

__all__ = ["dump_params"]
