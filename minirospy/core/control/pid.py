"""A PID controller. Source: http://wiki.ros.org/control_toolbox."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from minirospy.core.control.controller import ControllerError
from minirospy.core.control.parameters import Parameters

__all__ = ["Pid", "PidGains", "PidTerms"]


class PidGains(NamedTuple):
    """PID gains, and the limits of the integral term.

    Without ``antiwindup``, the integral of the error is unlimited, and only its contribution to the command is clamped to
    ``i_min`` and ``i_max``. With ``antiwindup``, the integral itself is clamped, so the contribution shrinks as soon as the error
    changes sign.
    """

    p: float = 0.0
    i: float = 0.0
    d: float = 0.0
    i_max: float = 0.0
    i_min: float = -0.0
    antiwindup: bool = False

    @classmethod
    def read(cls, parameters: Parameters) -> PidGains:
        """Return the gains in a namespace. Raise ControllerError if ``p`` is missing, ValueError if a number is not finite."""
        if not parameters.has_number("p"):
            raise ControllerError(f"No p gain specified for pid.  Namespace: {parameters.namespace}")
        i_clamp = abs(parameters.finite("i_clamp", 0.0))
        return cls(
            parameters.finite("p", 0.0),
            parameters.finite("i", 0.0),
            parameters.finite("d", 0.0),
            abs(parameters.finite("i_clamp_max", i_clamp)),
            -abs(parameters.finite("i_clamp_min", i_clamp)),
            parameters.flag("antiwindup", False),
        )


class PidTerms(NamedTuple):
    """The terms of a command, and the seconds since the previous command."""

    dt: float
    p: float
    i: float
    d: float


class Pid:
    """A PID controller. ``gains`` may be set at any time from any thread; only one thread may call ``compute`` and ``reset``."""

    def __init__(
        self,
        p: float = 0.0,
        i: float = 0.0,
        d: float = 0.0,
        i_max: float = 0.0,
        i_min: float = -0.0,
        antiwindup: bool = False,
    ) -> None:
        self.gains = PidGains(p, i, d, i_max, i_min, antiwindup)
        self.on_computed: Callable[[PidTerms], None] | None = None  # called with the terms of each command
        self.reset()

    def reset(self) -> None:
        """Discard all errors. As in ROS, the next derivative is computed as if the previous error were 0."""
        self.error = 0.0  # target - state in the last call
        self.error_integral = 0.0  # error times seconds
        self.error_rate = 0.0  # error per second
        self.command = 0.0  # result of the last call with valid arguments
        self._last_error = 0.0

    def compute(self, error: float, error_rate: float | None, dt: float) -> float:
        """Return the command for an error (target - state) that has lasted ``dt`` seconds.

        ``error_rate``: the derivative of the error; if None, it is computed from the previous error. If ``dt`` is 0 or a number
        is not finite, return 0 and leave the integral unchanged.
        """
        if dt == 0.0 or not math.isfinite(error) or not math.isfinite(dt):
            return 0.0
        if error_rate is None:
            error_rate = self.error_rate
            if dt > 0.0:
                error_rate = (error - self._last_error) / dt
                self._last_error = error
        if not math.isfinite(error_rate):
            return 0.0

        p, i, d, i_max, i_min, antiwindup = self.gains
        integral = self.error_integral + dt * error
        if antiwindup and i != 0.0:
            low, high = sorted((i_min / i, i_max / i))
            integral = min(max(integral, low), high)
        p_term = p * error
        i_term = i * integral if antiwindup else min(max(i * integral, i_min), i_max)
        d_term = d * error_rate
        command = p_term + i_term + d_term
        if not math.isfinite(command):
            return 0.0  # the gains are not finite, or too large

        self.error = error
        self.error_rate = error_rate
        self.error_integral = integral
        self.command = command
        if self.on_computed is not None:
            self.on_computed(PidTerms(dt, p_term, i_term, d_term))
        return command
