"""roslib.launcher, provided by minirospy: a package and what it needs on sys.path."""

from minirospy.ros.roslib.roslib.launcher import load_manifest

__all__ = ["load_manifest"]
