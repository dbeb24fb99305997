"""The rate at which a controller publishes; it cannot exceed the rate of the loop."""

from __future__ import annotations

from minirospy.base.times import Time
from minirospy.core.control.controller import ControllerError
from minirospy.core.control.parameters import Parameters

__all__ = ["PublishRate", "nanoseconds"]

MAX_BEHIND = (
    1_000_000_000  # ns; after a longer gap, restart the schedule now instead of catching up in each cycle
)


def nanoseconds(time: Time) -> int:
    """Return a time as an int of nanoseconds, which is exact and faster to compute with."""
    return time.secs * 1_000_000_000 + time.nsecs


class PublishRate:
    """Decides in which cycles a controller publishes. The rate refers to ROS time; 0 or less means never."""

    def __init__(self, hertz: float) -> None:
        self.set(hertz)
        self._last: int | None = None  # scheduled time of the last message, in ns

    @classmethod
    def read(cls, parameters: Parameters) -> PublishRate:
        """Return the rate from the parameter ``publish_rate``. Raise ControllerError if it is not set."""
        if not parameters.has_number("publish_rate"):
            raise ControllerError("Parameter 'publish_rate' not set")
        return cls(parameters.finite("publish_rate", 0.0))

    def set(self, hertz: float) -> None:
        """Change the rate, from any thread."""
        self._period = round(1e9 / hertz) if hertz > 0.0 else None

    def start(self, time: Time, *, is_due: bool = False) -> None:
        """Restart the schedule: the first message is due after one period, or in the next cycle if ``is_due``."""
        self._last = nanoseconds(time) - (self._period or 0) * is_due

    def is_due(self, time: Time) -> bool:
        """Return whether to publish in this cycle. If time has jumped back, restart the schedule at ``time``."""
        period = self._period  # read once, because another thread may change it
        if period is None:
            return False
        now = nanoseconds(time)
        if self._last is None or now < self._last:
            self._last = now
        behind = now - self._last
        if behind <= period:
            return False
        self._last = now if behind > period + MAX_BEHIND else self._last + period
        return True
