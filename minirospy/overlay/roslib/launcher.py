"""roslib.launcher, filled in by minirospy."""

from minirospy.compat.roslib.packages import load_manifest

__all__ = ["load_manifest"]
