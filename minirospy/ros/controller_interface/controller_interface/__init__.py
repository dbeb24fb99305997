"""The base class of controllers: ``from controller_interface import Controller``.

ROS's package has only C++ headers; the names are the same here. Source: http://wiki.ros.org/controller_interface.
"""

from minirospy.core.control.controller import (
    Controller,
    ControllerContext,
    ControllerError,
    ControllerState,
    Resources,
)
from minirospy.core.control.parameters import Parameters

__all__ = ["Controller", "ControllerContext", "ControllerError", "ControllerState", "Parameters", "Resources"]
