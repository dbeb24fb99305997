"""roslib: functions for packages, manifests and stacks. Source: http://wiki.ros.org/roslib."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.roslib.roslib import exceptions as exceptions
    from minirospy.ros.roslib.roslib import launcher as launcher
    from minirospy.ros.roslib.roslib import packages as packages
    from minirospy.ros.roslib.roslib.launcher import load_manifest

__all__ = ["is_interactive", "load_manifest", "set_interactive"]

_interactive = [False]


def is_interactive() -> bool:
    """Return whether the process is interactive, as set by set_interactive()."""
    return _interactive[0]


def set_interactive(interactive: bool) -> None:
    """Set the value that is_interactive() returns."""
    _interactive[0] = interactive
