"""roslaunch.substitution_args, filled in by minirospy."""

from minirospy.compat.roslaunch.config import ArgException, SubstitutionException, resolve_args

__all__ = ["ArgException", "SubstitutionException", "resolve_args"]
