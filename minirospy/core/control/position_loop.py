"""Drives a joint to a position: a PID controller computes the joint's velocity or effort.

Source: http://wiki.ros.org/effort_controllers.
"""

from __future__ import annotations

import math

from minirospy.core.control.hardware import Joint
from minirospy.core.control.pid import Pid
from minirospy.core.urdf.model import Joint as UrdfJoint
from minirospy.core.urdf.model import JointType

__all__ = ["PositionLoop"]


class PositionLoop:
    """A joint with its limits and its PID controller.

    Targets are clamped to the limits of a revolute or prismatic joint. A rotating joint takes the shorter way; a revolute joint
    takes the longer way if the shorter one would leave its limits.
    """

    def __init__(self, joint: Joint, described: UrdfJoint, pid: Pid) -> None:
        self.joint = joint
        self.pid = pid
        limit = described.limit if described.type in (JointType.REVOLUTE, JointType.PRISMATIC) else None
        self._lower = limit.lower if limit else -math.inf
        self._upper = limit.upper if limit else math.inf
        self._turns = described.type in (JointType.REVOLUTE, JointType.CONTINUOUS)

    def clamp(self, position: float) -> float:
        """Return the nearest position within the joint's limits."""
        return min(max(position, self._lower), self._upper)

    def error(self, target: float) -> float:
        """Return the signed distance to a target within the limits. The result is not finite if an argument is not finite."""
        position = self.joint.position
        way = target - position
        if not self._turns or not math.isfinite(way):
            return way
        way = math.remainder(way, math.tau)
        if self._lower <= position + way <= self._upper:
            return way
        other = way - math.copysign(math.tau, way)
        return other if self._lower <= position + other <= self._upper else way
