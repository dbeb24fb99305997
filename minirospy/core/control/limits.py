"""Joint limits: read from a robot description and from parameters, and applied to commands.

The loop applies them after updating the controllers, before ``hardware.write``. Positions are in radians or metres, velocities in
rad/s or m/s, accelerations in rad/s^2 or m/s^2, efforts in N m or N.
Source: the code of joint_limits_interface in the noetic release.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite, isinf
from typing import NamedTuple

from minirospy.base.times import Duration
from minirospy.core.control.hardware import Interface, Joint
from minirospy.core.control.parameters import Parameters
from minirospy.core.urdf.model import Joint as UrdfJoint
from minirospy.core.urdf.model import JointType

__all__ = ["JointLimits", "LimitEnforcer", "SoftLimits", "read_limits"]


class SoftLimits(NamedTuple):
    """Positions near which a joint slows down: its speed is at most ``k_position`` times its distance from them."""

    lower: float
    upper: float
    k_position: float  # 1/s
    k_velocity: float  # velocity gain, in N m s/rad or N s/m


@dataclass(frozen=True)
class JointLimits:
    """The limits of a joint; a missing limit is infinite."""

    lower: float = -inf
    upper: float = inf
    velocity: float = inf
    acceleration: float = inf
    effort: float = inf
    soft: SoftLimits | None = None


def read_limits(joint: UrdfJoint | None, parameters: Parameters, name: str) -> JointLimits:
    """Return a joint's limits from the description, overridden by the parameters below ``joint_limits/NAME``.

    Raise ValueError if a limit is not finite, or if the lowest position is above the highest.
    """
    limits = _of_description(joint) if joint else JointLimits()

    limits = replace(
        limits,
        velocity=abs(_limit(parameters, "has_velocity_limits", "max_velocity", limits.velocity)),
        acceleration=abs(
            _limit(parameters, "has_acceleration_limits", "max_acceleration", limits.acceleration)
        ),
        effort=abs(_limit(parameters, "has_effort_limits", "max_effort", limits.effort)),
    )
    lower = _limit(parameters, "has_position_limits", "min_position", limits.lower, -inf)
    upper = _limit(parameters, "has_position_limits", "max_position", limits.upper)
    is_complete = parameters.get("min_position") is not None and parameters.get("max_position") is not None
    if is_complete or not parameters.flag("has_position_limits", False):
        limits = replace(limits, lower=lower, upper=upper)
    if limits.lower > limits.upper:
        raise ValueError(
            f"joint '{name}': its lowest position {limits.lower} is above its highest, {limits.upper}"
        )

    soft = [
        parameters.finite(key, inf)
        for key in ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity")
        if parameters.get(key) is not None
    ]
    if parameters.flag("has_soft_limits", False) and len(soft) == len(SoftLimits._fields):
        limits = replace(limits, soft=SoftLimits(*soft))
    # With k_position 0, the formula allows no motion at all.
    return limits if limits.soft and limits.soft.k_position > 0 else replace(limits, soft=None)


def _of_description(joint: UrdfJoint) -> JointLimits:
    if joint.limit is None:
        return JointLimits()
    limits = JointLimits(velocity=abs(joint.limit.velocity), effort=abs(joint.limit.effort))
    if joint.type in (JointType.REVOLUTE, JointType.PRISMATIC):
        limits = replace(limits, lower=joint.limit.lower, upper=joint.limit.upper)
    if joint.safety:
        safety = joint.safety
        soft = SoftLimits(
            safety.soft_lower or 0.0, safety.soft_upper or 0.0, safety.k_position, safety.k_velocity
        )
        limits = replace(limits, soft=soft)
    return limits


def _limit(parameters: Parameters, flag: str, key: str, given: float, none: float = inf) -> float:
    """Return the parameter ``key`` if ``flag`` is true, ``none`` if it is false, ``given`` if one of the two is not set."""
    has = parameters.get(flag)
    if has is False:
        return none
    return parameters.finite(key, given) if has is True and parameters.get(key) is not None else given


class LimitEnforcer:
    """Keeps commands within limits. If a command is not finite, the joint holds its position, or its effort becomes 0."""

    def __init__(self, joints: Iterable[Joint], limits: Mapping[str, JointLimits]) -> None:
        self._joints = [_Limiter(joint, limits.get(joint.name, JointLimits())) for joint in joints]

    def enforce(self, period: Duration) -> list[str]:
        """Limit the commands of all joints that a controller commands; return the joints whose commands were not finite."""
        seconds = period.to_sec()
        invalid: list[str] = []
        for each in self._joints:
            active = each.joint.active
            if active is not each.active:
                each.reset(active)
            if each.enforce and not each.enforce(seconds):
                invalid.append(each.joint.name)
        return invalid


class _Limiter:
    """The limits of one joint, and its last command. ``enforce`` returns False if the command was not finite."""

    __slots__ = ("active", "enforce", "joint", "limits", "previous")

    def __init__(self, joint: Joint, limits: JointLimits) -> None:
        self.joint = joint
        self.limits = limits
        self.active: Interface | None = None
        self.previous = 0.0  # the last commanded position or velocity
        self.enforce: Callable[[float], bool] | None = None

    def reset(self, active: Interface | None) -> None:
        """Restart from the present position, or from velocity 0, after another interface or none has commanded the joint."""
        self.active = active
        is_velocity = active is Interface.VELOCITY
        self.previous = 0.0 if is_velocity else self.joint.position
        self.enforce = _METHODS[active](self) if active else None

    def position(self, seconds: float) -> bool:
        joint, limits, previous = self.joint, self.limits, self.previous
        command = joint.position_command
        is_valid = isfinite(command)
        if not is_valid:
            command = previous
        lowest, highest = -limits.velocity, limits.velocity
        if (soft := limits.soft) and not isinf(limits.lower):
            lowest, highest = _soft_velocities(soft, previous, limits.velocity)
        command = min(max(command, limits.lower), limits.upper)
        if isfinite(highest):
            # The velocity limit takes precedence over the position limit: a joint outside its limits returns without a jump.
            command = min(max(command, previous + lowest * seconds), previous + highest * seconds)
        joint.position_command = self.previous = command
        return is_valid

    def velocity(self, seconds: float) -> bool:
        joint, limits = self.joint, self.limits
        command = joint.velocity_command
        is_valid = isfinite(command)
        if not is_valid:
            command = 0.0
        low, high, previous = -limits.velocity, limits.velocity, self.previous
        if soft := limits.soft:
            previous = joint.velocity
            if not isinf(limits.lower):
                low, high = _soft_velocities(soft, joint.position, limits.velocity)
        if not isinf(limits.acceleration):
            change = limits.acceleration * seconds
            low, high = max(previous - change, low), min(previous + change, high)
        joint.velocity_command = self.previous = min(max(command, low), high)
        return is_valid

    def effort(self, _: float) -> bool:
        joint, limits = self.joint, self.limits
        command, position, velocity = joint.effort_command, joint.position, joint.velocity
        is_valid = isfinite(command)
        if not is_valid:
            command = 0.0
        low, high = -limits.effort, limits.effort
        if soft := limits.soft:
            lowest, highest = -limits.velocity, limits.velocity
            if not isinf(limits.lower):
                lowest, highest = _soft_velocities(soft, position, limits.velocity)
            if isfinite(lowest) and isfinite(highest):
                low = min(max(-soft.k_velocity * (velocity - lowest), low), high)
                high = min(max(-soft.k_velocity * (velocity - highest), -limits.effort), high)
        else:
            if position < limits.lower or velocity < -limits.velocity:
                low = 0.0
            if position > limits.upper or velocity > limits.velocity:
                high = 0.0
        joint.effort_command = min(max(command, low), high)
        return is_valid

    def position_and_velocity(self, seconds: float) -> bool:
        joint, limits = self.joint, self.limits
        is_valid = self.position(seconds) and isfinite(joint.velocity_command + joint.acceleration_command)
        if not is_valid:
            joint.velocity_command = joint.acceleration_command = 0.0
        joint.velocity_command = min(max(joint.velocity_command, -limits.velocity), limits.velocity)
        joint.acceleration_command = min(
            max(joint.acceleration_command, -limits.acceleration), limits.acceleration
        )
        return is_valid


_METHODS: dict[Interface, Callable[[_Limiter], Callable[[float], bool]]] = {
    Interface.POSITION: lambda each: each.position,
    Interface.VELOCITY: lambda each: each.velocity,
    Interface.EFFORT: lambda each: each.effort,
    Interface.POS_VEL: lambda each: each.position_and_velocity,
    Interface.POS_VEL_ACC: lambda each: each.position_and_velocity,
}


def _soft_velocities(soft: SoftLimits, position: float, velocity: float) -> tuple[float, float]:
    """Return the lowest and highest velocity that the soft limits allow at a position."""
    lowest = -soft.k_position * (position - soft.lower)
    highest = -soft.k_position * (position - soft.upper)
    return min(max(lowest, -velocity), velocity), min(max(highest, -velocity), velocity)
