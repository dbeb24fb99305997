"""Base classes of controllers that forward commands: ``from forward_command_controller import ForwardCommandController``.

Source: http://wiki.ros.org/forward_command_controller.
"""

from __future__ import annotations

import math
from contextlib import closing
from typing import ClassVar

from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, Resources
from minirospy.core.control.hardware import COMMAND_FIELDS, Interface, Joint
from minirospy.ros.forward_command_controller.joints import CommandTopic, claim_group, claim_joint

__all__ = ["ForwardCommandController", "ForwardJointGroupCommandController"]


class ForwardCommandController(Controller):
    """Forwards numbers from the topic ``command`` to a joint. Position commands start at the current position, others at 0.

    A subclass sets ``interfaces`` to the interface that it commands.
    """

    is_group: ClassVar[bool] = False  # whether one message commands several joints

    _joints: list[Joint]

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Claim the joints and subscribe to the topic."""
        (interface,) = self.interfaces
        self._field = COMMAND_FIELDS[interface]
        if self.is_group:
            self._joints = claim_group(hardware, context, interface)
        else:
            self._joints = [claim_joint(hardware, context, interface)]
        command = CommandTopic(context, len(self._joints), is_group=self.is_group)
        self._command = self.opened.enter_context(closing(command))

    def starting(self, time: Time) -> None:
        """Command the current positions or, if the interface is not for positions, 0."""
        if self.interfaces == (Interface.POSITION,):
            self._command.values = [
                each.position if math.isfinite(each.position) else each.position_command
                for each in self._joints
            ]
        else:
            self._command.values = [0.0] * len(self._joints)

    def update(self, time: Time, period: Duration) -> None:
        """Set the joint commands."""
        field = self._field
        for joint, value in zip(self._joints, self._command.values, strict=True):
            setattr(joint, field, value)


class ForwardJointGroupCommandController(ForwardCommandController):
    """Forwards numbers from the topic ``command`` to the joints in the parameter ``joints``."""

    is_group = True
