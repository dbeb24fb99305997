"""roslib.launcher, filled in by minirospy."""

from minirospy.compat.roslib.launcher import load_manifest

__all__ = ["load_manifest"]
