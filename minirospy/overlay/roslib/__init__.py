"""roslib, filled in by minirospy. Source: http://wiki.ros.org/roslib."""

from minirospy.workspace.roslib import load_manifest
from roslib import exceptions as exceptions
from roslib import launcher as launcher
from roslib import packages as packages

__all__ = ["is_interactive", "load_manifest", "set_interactive"]

_interactive = [False]


def is_interactive() -> bool:
    """Whether the process belongs to an interactive shell, as it says itself."""
    return _interactive[0]


def set_interactive(interactive: bool) -> None:
    """Say that the process belongs to an interactive shell."""
    _interactive[0] = interactive
