"""roslib, provided by minirospy."""

from minirospy.ros.roslib.roslib import __getattr__ as __getattr__
from minirospy.ros.roslib.roslib import is_interactive, set_interactive
from minirospy.ros.roslib.roslib.launcher import load_manifest
from roslib import exceptions as exceptions
from roslib import launcher as launcher
from roslib import packages as packages

__all__ = ["is_interactive", "load_manifest", "set_interactive"]
