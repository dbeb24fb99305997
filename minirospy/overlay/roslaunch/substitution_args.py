"""roslaunch.substitution_args, filled in by minirospy."""

from minirospy.launch.config import ArgException, SubstitutionException, resolve_args

__all__ = ["ArgException", "SubstitutionException", "resolve_args"]
