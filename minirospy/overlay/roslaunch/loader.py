"""roslaunch.loader, filled in by minirospy."""

from __future__ import annotations

from typing import Any

import rosparam as rosparam

from minirospy.launch import substitution
from minirospy.launch.config import Param, RLException, XmlParseException
from minirospy.launch.config import XmlParseException as LoadException

__all__ = ["LoadException", "Param", "RLException", "XmlParseException", "convert_value"]


def convert_value(value: str, type_: str) -> Any:
    """A parameter's text as a value of ``type_``: str, int, double, bool, yaml, or auto. Raises ValueError."""
    return substitution.convert(value, type_)
