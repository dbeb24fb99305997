"""roslaunch.loader."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.ros.roslaunch.launcher import substitution

if TYPE_CHECKING:
    import rosparam as rosparam

    from minirospy.ros.roslaunch.roslaunch.core import Param, RLException
    from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlParseException
    from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlParseException as LoadException

__all__ = ["LoadException", "Param", "RLException", "XmlParseException", "convert_value"]


def convert_value(value: str, type_: str) -> object:
    """Convert a parameter's text to ``type_``: str, int, double, bool, yaml, or auto.

    Raise ValueError if the type is unknown or the text does not match it.
    """
    return substitution.convert(value, type_)
