"""roslaunch.loader: conversion of parameter values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.ros.roslaunch.launcher import substitution
from minirospy.ros.submodules import modules_on_first_use

if TYPE_CHECKING:
    import rosparam as rosparam

    from minirospy.ros.roslaunch.roslaunch.core import Param, RLException
    from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlParseException
    from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlParseException as LoadException

__all__ = ["LoadException", "Param", "RLException", "XmlParseException", "convert_value"]

__getattr__ = modules_on_first_use("roslaunch.loader", "errno os sys yaml")


def convert_value(value: str, type_: str) -> object:
    """Convert a parameter's text to ``type_``: str, int, double, bool, yaml, or auto.

    Raise ValueError if the type is unknown or the text does not match it.
    """
    return substitution.convert(value, type_)
