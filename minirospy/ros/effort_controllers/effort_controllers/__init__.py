"""Controllers of effort-controlled joints: ``from effort_controllers import JointEffortController``.

Source: http://wiki.ros.org/effort_controllers.
"""

from __future__ import annotations

from minirospy.core.control.hardware import Interface
from minirospy.ros.forward_command_controller.forward_command_controller import (
    ForwardCommandController,
    ForwardJointGroupCommandController,
)
from minirospy.ros.forward_command_controller.pid_controllers import (
    PidJointGroupPositionController,
    PidJointPositionController,
    PidJointVelocityController,
)

__all__ = [
    "JointEffortController",
    "JointGroupEffortController",
    "JointGroupPositionController",
    "JointPositionController",
    "JointVelocityController",
]


class JointPositionController(PidJointPositionController):
    """Reaches the position of a joint by its effort."""

    interfaces = (Interface.EFFORT,)


class JointVelocityController(PidJointVelocityController):
    """Reaches the velocity of a joint by its effort."""

    interfaces = (Interface.EFFORT,)


class JointEffortController(ForwardCommandController):
    """Passes efforts on to a joint."""

    interfaces = (Interface.EFFORT,)


class JointGroupEffortController(ForwardJointGroupCommandController):
    """Passes efforts on to joints."""

    interfaces = (Interface.EFFORT,)


class JointGroupPositionController(PidJointGroupPositionController):
    """Reaches the positions of joints by their efforts."""

    interfaces = (Interface.EFFORT,)
