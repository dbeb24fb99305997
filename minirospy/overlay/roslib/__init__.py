"""roslib, provided by minirospy."""

from minirospy.compat.roslib import __getattr__ as __getattr__
from minirospy.compat.roslib import is_interactive, set_interactive
from minirospy.compat.roslib.launcher import load_manifest
from roslib import exceptions as exceptions
from roslib import launcher as launcher
from roslib import packages as packages

__all__ = ["is_interactive", "load_manifest", "set_interactive"]
