"""Times and durations as in ROS messages: seconds and nanoseconds, normalized.

Source: http://wiki.ros.org/genpy, http://docs.ros.org/api/genpy/html/.
"""

from __future__ import annotations

import operator
from typing import TypeVar, overload

__all__ = ["Duration", "TVal", "Time"]

_BILLION = 1_000_000_000
_V = TypeVar("_V", bound="TVal")


class TVal:
    """The base class of Time and Duration: ``secs`` and ``nsecs``, with 0 <= nsecs < 1e9 once normalized."""

    __slots__ = ["secs", "nsecs"]  # noqa: RUF023 - genpy's order

    def __init__(self, secs: float = 0, nsecs: int = 0) -> None:
        """Create a time or duration. ``secs`` may be a float if ``nsecs`` is 0.

        Raise ValueError or TypeError if an argument is invalid.
        """
        if type(secs) is int and type(nsecs) is int and 0 <= nsecs < _BILLION:
            self.secs: int = secs
            self.nsecs: int = nsecs
            return
        if isinstance(secs, float) or not _is_integer(secs):
            if nsecs:
                raise ValueError("if secs is a float, nsecs cannot be set")
            secs, nsecs = _split(secs)
        self.secs = int(secs)
        self.nsecs = int(nsecs)
        self.canon()

    @classmethod
    def from_sec(cls: type[_V], float_secs: float) -> _V:
        """Convert seconds, as a float, to a time or duration."""
        return cls(*_split(float_secs))

    def is_zero(self) -> bool:
        """Return whether the time or duration is zero."""
        return not (self.secs or self.nsecs)

    def set(self, secs: int, nsecs: int) -> None:
        """Set ``secs`` and ``nsecs`` without normalizing."""
        self.secs = secs
        self.nsecs = nsecs

    def canon(self) -> None:
        """Normalize the value, so that 0 <= nsecs < 1e9."""
        if not 0 <= self.nsecs < _BILLION:
            carry, self.nsecs = divmod(self.nsecs, _BILLION)
            self.secs += carry

    def to_sec(self) -> float:
        """Return the seconds as a float."""
        return self.secs + self.nsecs / 1e9

    def to_nsec(self) -> int:
        """Return the time or duration in nanoseconds."""
        secs, nsecs = self.secs, self.nsecs
        if type(secs) is int and type(nsecs) is int:
            return secs * _BILLION + nsecs
        # Convert to int first: the program may have assigned fractions, or numpy values, which overflow.
        whole, rest = _split(secs)
        return whole * _BILLION + rest + int(nsecs)

    def __bool__(self) -> bool:
        return bool(self.secs or self.nsecs)

    # A Time compares only with Times, a Duration only with Durations, and a plain TVal with both.
    def __lt__(self, other: TVal) -> bool:
        return self.to_nsec() < other.to_nsec() if isinstance(other, TVal) else NotImplemented

    def __le__(self, other: TVal) -> bool:
        return self.to_nsec() <= other.to_nsec() if isinstance(other, TVal) else NotImplemented

    def __gt__(self, other: TVal) -> bool:
        return self.to_nsec() > other.to_nsec() if isinstance(other, TVal) else NotImplemented

    def __ge__(self, other: TVal) -> bool:
        return self.to_nsec() >= other.to_nsec() if isinstance(other, TVal) else NotImplemented

    def __hash__(self) -> int:
        return hash(("time" if isinstance(self, Time) else "duration", self.secs, self.nsecs))

    def __str__(self) -> str:
        return str(self.to_nsec())

    def __repr__(self) -> str:
        return f"genpy.{type(self).__name__}[{self.to_nsec()}]"

    def __getstate__(self) -> list[int]:
        return [self.secs, self.nsecs]

    def __setstate__(self, state: list[int]) -> None:
        self.secs, self.nsecs = state

    def _of(self: _V, nanoseconds: int) -> _V:
        return type(self)(*divmod(nanoseconds, _BILLION))


class Time(TVal):
    """A point in time since the epoch; never negative."""

    # Use genpy's module name, so that programs that use real ROS can load pickles made here, and vice versa.
    __module__ = "genpy.rostime"

    __slots__: list[str] = []

    def __init__(self, secs: float = 0, nsecs: int = 0) -> None:
        super().__init__(secs, nsecs)
        if self.secs < 0:
            raise TypeError("time values must be positive")

    def to_time(self) -> float:
        """Return the seconds as a float, like ``time.time()``. The same as ``to_sec``."""
        return self.to_sec()

    def __add__(self, other: Duration) -> Time:
        if not isinstance(other, Duration):
            return NotImplemented
        return self._of(self.to_nsec() + other.to_nsec())

    __radd__ = __add__

    @overload
    def __sub__(self, other: Time) -> Duration: ...

    @overload
    def __sub__(self, other: Duration) -> Time: ...

    def __sub__(self, other: Time | Duration) -> Time | Duration:
        if isinstance(other, Time):
            return Duration(*divmod(self.to_nsec() - other.to_nsec(), _BILLION))
        if isinstance(other, Duration):
            return self._of(self.to_nsec() - other.to_nsec())
        return NotImplemented

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Time) and self.to_nsec() == other.to_nsec()

    def __lt__(self, other: TVal) -> bool:
        return self.to_nsec() < other.to_nsec() if isinstance(other, Time) else NotImplemented

    def __le__(self, other: TVal) -> bool:
        return self.to_nsec() <= other.to_nsec() if isinstance(other, Time) else NotImplemented

    def __gt__(self, other: TVal) -> bool:
        return self.to_nsec() > other.to_nsec() if isinstance(other, Time) else NotImplemented

    def __ge__(self, other: TVal) -> bool:
        return self.to_nsec() >= other.to_nsec() if isinstance(other, Time) else NotImplemented

    __hash__ = TVal.__hash__


class Duration(TVal):
    """A time span. If it is negative, only ``secs`` is negative: -0.5 s is ``secs`` -1 and ``nsecs`` 500_000_000."""

    __module__ = "genpy.rostime"

    __slots__: list[str] = []

    def __add__(self, other: Duration) -> Duration:
        if isinstance(other, Duration):
            return self._of(self.to_nsec() + other.to_nsec())
        return NotImplemented

    def __sub__(self, other: Duration) -> Duration:
        if isinstance(other, Duration):
            return self._of(self.to_nsec() - other.to_nsec())
        return NotImplemented

    def __neg__(self) -> Duration:
        return self._of(-self.to_nsec())

    def __abs__(self) -> Duration:
        return self._of(abs(self.to_nsec()))

    def __mul__(self, factor: float) -> Duration:
        if isinstance(factor, int):
            return self._of(self.to_nsec() * factor)
        if isinstance(factor, float):
            return type(self).from_sec(self.to_sec() * factor)
        return NotImplemented

    __rmul__ = __mul__

    @overload
    def __truediv__(self, other: float) -> Duration: ...

    @overload
    def __truediv__(self, other: Duration) -> float: ...

    def __truediv__(self, other: float | Duration) -> float | Duration:
        if isinstance(other, int | float):
            return type(self).from_sec(self.to_sec() / float(other))
        if isinstance(other, Duration):
            return self.to_sec() / other.to_sec()
        return NotImplemented

    @overload
    def __floordiv__(self, other: float) -> Duration: ...

    @overload
    def __floordiv__(self, other: Duration) -> int: ...

    def __floordiv__(self, other: float | Duration) -> int | Duration:
        if isinstance(other, int | float):
            return type(self).from_sec(self.to_sec() // other)
        if isinstance(other, Duration):
            return int(self.to_sec() // other.to_sec())
        return NotImplemented

    def __mod__(self, other: Duration) -> Duration:
        if isinstance(other, Duration):
            return self._of(self.to_nsec() % other.to_nsec())
        return NotImplemented

    def __divmod__(self, other: Duration) -> tuple[int, Duration]:
        if isinstance(other, Duration):
            whole, rest = divmod(self.to_nsec(), other.to_nsec())
            return whole, self._of(rest)
        return NotImplemented

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Duration) and self.to_nsec() == other.to_nsec()

    def __lt__(self, other: TVal) -> bool:
        return self.to_nsec() < other.to_nsec() if isinstance(other, Duration) else NotImplemented

    def __le__(self, other: TVal) -> bool:
        return self.to_nsec() <= other.to_nsec() if isinstance(other, Duration) else NotImplemented

    def __gt__(self, other: TVal) -> bool:
        return self.to_nsec() > other.to_nsec() if isinstance(other, Duration) else NotImplemented

    def __ge__(self, other: TVal) -> bool:
        return self.to_nsec() >= other.to_nsec() if isinstance(other, Duration) else NotImplemented

    __hash__ = TVal.__hash__


# Define the same slots as genpy's classes; the attributes themselves belong to TVal.
Time.__slots__ = Duration.__slots__ = TVal.__slots__


def _split(seconds: float) -> tuple[int, int]:
    """Split into whole seconds and remaining nanoseconds, which are truncated instead of rounded, as in genpy."""
    whole = int(seconds)
    return whole, int(float(seconds - whole) * 1e9)


def _is_integer(value: object) -> bool:
    """Return whether a number is an integer, including numpy's integers."""
    try:
        operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        return False
    return True
