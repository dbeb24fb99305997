"""roslib. Source: http://wiki.ros.org/roslib."""

from minirospy.ros.submodules import on_first_use

__all__ = ["is_interactive", "set_interactive"]

__getattr__ = on_first_use("roslib", "manifest", "stacks")

_interactive = [False]


def is_interactive() -> bool:
    """Return whether set_interactive() marked the process as interactive."""
    return _interactive[0]


def set_interactive(interactive: bool) -> None:
    """Set whether the process is interactive."""
    _interactive[0] = interactive
