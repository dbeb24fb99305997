"""Call a watchdog's handler in place of the system."""

from __future__ import annotations

import signal
from types import FrameType

from minirospy.client.shutdown import Action
from minirospy.client.signals import SignalWatchdog

__all__ = ["nudge"]


def nudge(watchdog: SignalWatchdog, interrupt: Action | None = None, frame: FrameType | None = None) -> None:
    """Interrupt this thread as the watchdog's thread does. ``interrupt``: the exception to raise, if the machine demands one."""
    watchdog._interrupt = interrupt
    watchdog._is_nudge = True
    watchdog.on_signal(signal.SIGINT, frame)
