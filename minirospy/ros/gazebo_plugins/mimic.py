"""The mimic joint plugin of roboticsgroup: makes a joint follow another one."""

from __future__ import annotations

import math

from minirospy.ros.gazebo_ros.plugins import ModelPlugin

__all__ = ["MimicJoint"]


class MimicJoint(ModelPlugin):
    """Makes one joint follow another. Parameters: joint, mimicJoint, multiplier, offset, maxEffort (ignored without hasPID)."""

    def load(self) -> None:
        """Find the joints."""
        self._leader = self.joint(self.text("joint"))
        self._follower = self.joint(self.text("mimicJoint"))
        self._multiplier = self.number("multiplier", 1.0)
        self._offset = self.number("offset", 0.0)
        limit = self.number("maxEffort", 0.0)
        self._max_effort = limit if limit > 0 and self.element.first("hasPID") is not None else math.inf

    def update(self) -> None:
        """Update the follower joint's motor target."""
        target = self._multiplier * self._leader.position + self._offset
        self._follower.set_position(target, self._max_effort)
