"""A DiagnosticStatus with methods that fill its fields."""

from __future__ import annotations

from typing import Any, overload

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

__all__ = ["ERROR", "OK", "WARN", "DiagnosticStatusWrapper"]

OK = DiagnosticStatus.OK
WARN = DiagnosticStatus.WARN
ERROR = DiagnosticStatus.ERROR


class DiagnosticStatusWrapper(DiagnosticStatus):
    """A diagnostic_msgs/DiagnosticStatus to fill step by step and publish directly."""

    def __init__(self, *args: Any, **kwds: Any) -> None:
        """Set all fields by position, or some by keyword."""
        super().__init__(*args, **kwds)

    @overload
    def summary(self, status: DiagnosticStatus, /) -> None: ...

    @overload
    def summary(self, level: int, message: object, /) -> None: ...

    def summary(self, *args: object) -> None:
        """Set level and message: ``summary(level, message)``, or ``summary(status)`` to copy them."""
        self.level, message = _summary_of(args)
        self.message = str(message)

    def clearSummary(self) -> None:
        """Set the level to OK and the message to an empty string."""
        self.summary(OK, "")

    @overload
    def mergeSummary(self, status: DiagnosticStatus, /) -> None: ...

    @overload
    def mergeSummary(self, level: int, message: str, /) -> None: ...

    def mergeSummary(self, *args: object) -> None:
        """Merge another level and message into this status; the arguments are those of ``summary``.

        The higher level is used. If both levels are OK or neither is, the messages are joined. Otherwise, the message with the
        level that is not OK is used.
        """
        level, message = _summary_of(args)
        if (level > OK) == (self.level > OK):
            self.message = f"{self.message}; {message}" if self.message else message
        elif level > self.level:
            self.message = message
        self.level = max(self.level, level)

    def add(self, key: str, val: object) -> None:
        """Append a key and its value, converted to a string."""
        self.values.append(KeyValue(key, str(val)))


def _summary_of(args: tuple[object, ...]) -> tuple[int, str]:
    """Return the level and message. Raise TypeError if the arguments are neither a status nor a level and a message."""
    if len(args) == 2:
        level, message = args
    elif len(args) == 1 and isinstance(args[0], DiagnosticStatus):
        level, message = args[0].level, args[0].message
    else:
        raise TypeError("a summary is a DiagnosticStatus, or a level and a message")
    return level, message  # type: ignore[return-value]
