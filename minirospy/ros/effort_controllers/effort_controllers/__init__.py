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
    """Controls a joint's position by commanding its effort."""

    interfaces = (Interface.EFFORT,)


class JointVelocityController(PidJointVelocityController):
    """Controls a joint's velocity by commanding its effort."""

    interfaces = (Interface.EFFORT,)


class JointEffortController(ForwardCommandController):
    """Forwards effort commands to a joint."""

    interfaces = (Interface.EFFORT,)


class JointGroupEffortController(ForwardJointGroupCommandController):
    """Forwards effort commands to several joints."""

    interfaces = (Interface.EFFORT,)


class JointGroupPositionController(PidJointGroupPositionController):
    """Controls several joints' positions by commanding their efforts."""

    interfaces = (Interface.EFFORT,)
