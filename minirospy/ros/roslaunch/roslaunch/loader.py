"""roslaunch.loader: conversion of parameter values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.ros.roslaunch.roslaunch.substitution_args import convert_value

if TYPE_CHECKING:
    import rosparam as rosparam

    from minirospy.ros.roslaunch.roslaunch.core import Param, RLException
    from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlParseException
    from minirospy.ros.roslaunch.roslaunch.xmlloader import XmlParseException as LoadException

__all__ = ["LoadException", "Param", "RLException", "XmlParseException", "convert_value"]
