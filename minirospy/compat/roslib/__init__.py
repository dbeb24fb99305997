"""roslib, filled in by minirospy. Source: http://wiki.ros.org/roslib."""

__all__ = ["is_interactive", "set_interactive"]

_interactive = [False]


def is_interactive() -> bool:
    """Whether the process belongs to an interactive shell, as it says itself."""
    return _interactive[0]


def set_interactive(interactive: bool) -> None:
    """Say that the process belongs to an interactive shell."""
    _interactive[0] = interactive
