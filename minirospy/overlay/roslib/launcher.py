"""roslib.launcher, filled in by minirospy."""

from minirospy.workspace.roslib import load_manifest

__all__ = ["load_manifest"]
