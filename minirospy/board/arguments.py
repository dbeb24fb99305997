"""Check the arguments of RPi.GPIO's functions, with RPi.GPIO's error messages."""

from __future__ import annotations

import operator

from minirospy.base.notes import noted
from minirospy.board.events import Detector, Slope

__all__ = ["NO_BOUNCETIME", "channels_of", "detector_of", "level_of"]

NO_BOUNCETIME = -666  # RPi.GPIO's default: no debouncing


def channels_of(channel: object) -> list[int]:
    """Convert a channel or a sequence of channels to a list. Raise ValueError if one is not an integer."""
    if isinstance(channel, int):
        return [channel]
    if not isinstance(channel, (list, tuple)):
        error = ValueError("Channel must be an integer or list/tuple of integers")
        raise noted(error, f"it is {channel!r}; write the number without quotes")
    if not all(isinstance(one, int) for one in channel):
        raise ValueError("Channel must be an integer")
    return list(channel)


def level_of(value: object) -> int:
    """Convert a level argument to 0 or 1. Raise TypeError for None, a string, a list, or an object without ``__bool__``."""
    if isinstance(value, int):
        return 1 if value else 0
    if isinstance(value, (list, tuple, str, bytes)) or value is None or not hasattr(value, "__bool__"):
        raise TypeError("not a level")
    # Accept types like numpy.bool_, which are neither int nor bool.
    return 1 if value else 0


def detector_of(channel: int, edge: int, bouncetime: int) -> Detector:
    """Create a detector for an edge; ``bouncetime`` is in ms. Raise ValueError or TypeError if an argument is invalid."""
    # Require whole milliseconds. Like RPi.GPIO, raise TypeError for a time in seconds such as 0.2.
    edge, bouncetime = operator.index(edge), operator.index(bouncetime)
    if edge not in {Slope.RISING, Slope.FALLING, Slope.BOTH}:
        raise ValueError("The edge must be set to RISING, FALLING or BOTH")
    if bouncetime <= 0 and bouncetime != NO_BOUNCETIME:
        raise ValueError("Bouncetime must be greater than 0")
    return Detector(channel, Slope(edge), None if bouncetime == NO_BOUNCETIME else bouncetime / 1000)
