"""roslaunch.arg_dump, filled in by minirospy."""

from minirospy.compat.roslaunch.arg_dump import get_args

__all__ = ["get_args"]
