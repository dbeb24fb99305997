"""Limits on velocity, acceleration and jerk. Source: http://wiki.ros.org/diff_drive_controller."""

from __future__ import annotations

from dataclasses import dataclass

from minirospy.core.control.parameters import Parameters

__all__ = ["Range", "SpeedLimiter"]


@dataclass(frozen=True)
class Range:
    """A minimum and a maximum value."""

    low: float
    high: float

    def clamp(self, value: float, factor: float = 1.0) -> float:
        """Return the number nearest to ``value`` in the range [low * factor, high * factor]."""
        return min(max(self.low * factor, value), self.high * factor)


@dataclass(frozen=True)
class SpeedLimiter:
    """Limits on a linear or angular velocity (m or rad, and s), its acceleration and its jerk; None means unlimited."""

    velocity: Range | None = None
    acceleration: Range | None = None
    jerk: Range | None = None

    @classmethod
    def read(cls, parameters: Parameters) -> SpeedLimiter:
        """Return the limits in a namespace such as ``linear/x``. Raise ValueError if a limit is not finite."""

        def read_range(name: str) -> Range | None:
            high = parameters.finite(f"max_{name}", 0.0)
            low = parameters.finite(f"min_{name}", -high)
            return Range(low, high) if parameters.flag(f"has_{name}_limits", False) else None

        return cls(read_range("velocity"), read_range("acceleration"), read_range("jerk"))

    def limit(self, velocity: float, last: float, before_last: float, dt: float) -> float:
        """Return the allowed velocity nearest to ``velocity``. ``last`` is the velocity ``dt`` seconds before.

        As in ROS, the jerk in one cycle may reach twice its limit, and the acceleration and velocity limits are applied
        afterwards.
        """
        dt = max(dt, 0.0)
        if self.jerk is not None:
            change = last - before_last
            velocity = last + change + self.jerk.clamp(velocity - last - change, 2.0 * dt * dt)
        if self.acceleration is not None:
            velocity = last + self.acceleration.clamp(velocity - last, dt)
        if self.velocity is not None:
            velocity = self.velocity.clamp(velocity)
        return velocity
