"""roslaunch.arg_dump, provided by minirospy."""

from minirospy.ros.roslaunch.roslaunch.arg_dump import get_args

__all__ = ["get_args"]
