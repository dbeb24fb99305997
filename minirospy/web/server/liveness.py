"""Detect dead WebSocket clients: those that do not respond to pings or do not read. Pure."""

from __future__ import annotations

from enum import Enum, auto

__all__ = ["Liveness", "Verdict"]


class Verdict(Enum):
    """The result of a check: an action for the client."""

    PING = auto()
    """Send a ping."""
    WAIT = auto()
    """Do nothing, because a ping would be queued behind output that the client has not read yet."""
    SILENT = auto()
    """Disconnect, because the client has not responded to the ping."""
    STUCK = auto()
    """Disconnect, because the client does not read the output."""


class Liveness:
    """Tracks when the last data from a client arrived, and whether the client has been pinged since then.

    Times are in seconds, all on the same clock.
    """

    def __init__(self, silent_seconds: float, now: float) -> None:
        self.received = now  # when the last data arrived from the client
        self._silent_seconds = silent_seconds
        self._is_pinged = False  # set by a ping, cleared when data arrives

    def heard(self, now: float) -> None:
        """Record that data has arrived."""
        self.received = now
        self._is_pinged = False

    def is_stuck(self, now: float, progressed: float, *, is_full: bool) -> bool:
        """Return whether the client has not read anything for too long. ``progressed`` is the time of the last output."""
        return is_full and now - progressed > self._silent_seconds

    def check(self, now: float, progressed: float, *, is_full: bool) -> Verdict:
        """Return what to do with the client now."""
        if self.is_stuck(now, progressed, is_full=is_full):
            return Verdict.STUCK
        # A suspension of the machine makes the last data old, too, so a client counts as silent only if a ping is unanswered.
        if self._is_pinged and now - self.received > self._silent_seconds:
            return Verdict.SILENT
        if is_full:
            return Verdict.WAIT
        self._is_pinged = True
        return Verdict.PING
