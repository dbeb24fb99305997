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
    """Passes velocities on to a joint."""

    interfaces = (Interface.VELOCITY,)


class JointPositionController(PidJointPositionController):
    """Reaches the position of a joint by its velocity."""

    interfaces = (Interface.VELOCITY,)


class JointGroupVelocityController(ForwardJointGroupCommandController):
    """Passes velocities on to joints."""

    interfaces = (Interface.VELOCITY,)
