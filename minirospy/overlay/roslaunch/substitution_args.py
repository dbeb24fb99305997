"""roslaunch.substitution_args, filled in by minirospy."""

from minirospy.compat.roslaunch.substitution_args import ArgException, SubstitutionException, resolve_args

__all__ = ["ArgException", "SubstitutionException", "resolve_args"]
