"""RPi.GPIO on the virtual board; importing it on a Raspberry Pi issues a warning that the real library is missing."""

from __future__ import annotations

from minirospy.board import rpigpio
from minirospy.board.raspberry import warn_of_missing_library

__all__: list[str] = []


def __getattr__(name: str) -> object:
    return getattr(rpigpio, name)


warn_of_missing_library()
