"""Detection of WebSocket clients that are gone: they answer no ping, or read nothing. Pure."""

from __future__ import annotations

from enum import Enum, auto

__all__ = ["Liveness", "Verdict"]


class Verdict(Enum):
    """The result of a check, and what to do."""

    PING = auto()
    """Send a ping."""
    WAIT = auto()
    """Do nothing: output that the client has not taken yet is in front of a ping."""
    SILENT = auto()
    """Disconnect: the client has not answered a ping."""
    STUCK = auto()
    """Disconnect: the client has not read what was sent."""


class Liveness:
    """When a client was last heard, and whether it was pinged since. Times are in seconds of one clock."""

    def __init__(self, silent_seconds: float, now: float) -> None:
        self.received = now  # when bytes last came from the client
        self._silent_seconds = silent_seconds
        self._is_pinged = False  # from a ping until bytes come

    def heard(self, now: float) -> None:
        """Record that bytes have come."""
        self.received = now
        self._is_pinged = False

    def is_stuck(self, now: float, progressed: float, *, is_full: bool) -> bool:
        """Return whether the client has read nothing for too long; ``progressed``: when output was last written."""
        return is_full and now - progressed > self._silent_seconds

    def check(self, now: float, progressed: float, *, is_full: bool) -> Verdict:
        """Return what to do with the client now."""
        if self.is_stuck(now, progressed, is_full=is_full):
            return Verdict.STUCK
        # After a suspend the last bytes are old, and the client has not been pinged since.
        if self._is_pinged and now - self.received > self._silent_seconds:
            return Verdict.SILENT
        if is_full:
            return Verdict.WAIT
        self._is_pinged = True
        return Verdict.PING
