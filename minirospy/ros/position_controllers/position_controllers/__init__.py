"""Controllers of position-controlled joints: ``from position_controllers import JointPositionController``.

Source: http://wiki.ros.org/position_controllers.
"""

from __future__ import annotations

from minirospy.core.control.hardware import Interface
from minirospy.ros.forward_command_controller.forward_command_controller import (
    ForwardCommandController,
    ForwardJointGroupCommandController,
)

__all__ = ["JointGroupPositionController", "JointPositionController"]


class JointPositionController(ForwardCommandController):
    """Forwards position commands to a joint."""

    interfaces = (Interface.POSITION,)


class JointGroupPositionController(ForwardJointGroupCommandController):
    """Forwards position commands to several joints."""

    interfaces = (Interface.POSITION,)
