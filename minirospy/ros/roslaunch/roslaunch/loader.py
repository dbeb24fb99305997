"""roslaunch.loader."""

from __future__ import annotations

from minirospy.ros.roslaunch.launcher import substitution

__all__ = ["convert_value"]


def convert_value(value: str, type_: str) -> object:
    """Return a parameter's text as a value of ``type_``: str, int, double, bool, yaml, or auto. Raise ValueError."""
    return substitution.convert(value, type_)
