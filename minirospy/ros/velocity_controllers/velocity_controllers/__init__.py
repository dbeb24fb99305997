"""Controllers of velocity-controlled joints: ``from velocity_controllers import JointVelocityController``.

Source: http://wiki.ros.org/velocity_controllers.
"""

from __future__ import annotations

from minirospy.core.control.hardware import Interface
from minirospy.ros.forward_command_controller.forward_command_controller import (
    ForwardCommandController,
    ForwardJointGroupCommandController,
)
from minirospy.ros.forward_command_controller.pid_controllers import (
    PidJointPositionController,
)

__all__ = ["JointGroupVelocityController", "JointPositionController", "JointVelocityController"]


class JointVelocityController(ForwardCommandController):
    """Forwards velocity commands to one joint."""

    interfaces = (Interface.VELOCITY,)


class JointPositionController(PidJointPositionController):
    """Controls a joint's position by commanding its velocity."""

    interfaces = (Interface.VELOCITY,)


class JointGroupVelocityController(ForwardJointGroupCommandController):
    """Forwards velocity commands to several joints."""

    interfaces = (Interface.VELOCITY,)
