"""roslaunch.loader."""

from __future__ import annotations

from minirospy.ros.roslaunch.launcher import substitution

__all__ = ["convert_value"]


def convert_value(value: str, type_: str) -> object:
    """Convert a parameter's text to ``type_``: str, int, double, bool, yaml, or auto. Raise ValueError."""
    return substitution.convert(value, type_)
