"""The controller manager, for use in a user's node: ``from controller_manager import run``.

Source: http://wiki.ros.org/controller_manager.
"""

from minirospy.ros.controller_manager.loop import ControlLoop, run
from minirospy.ros.controller_manager.manager import ControllerManager

__all__ = ["ControlLoop", "ControllerManager", "run"]
