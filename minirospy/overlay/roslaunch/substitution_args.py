"""roslaunch.substitution_args, provided by minirospy: `$(find ...)` and the other substitution arguments."""

from minirospy.compat.roslaunch.substitution_args import ArgException, SubstitutionException, resolve_args

__all__ = ["ArgException", "SubstitutionException", "resolve_args"]
