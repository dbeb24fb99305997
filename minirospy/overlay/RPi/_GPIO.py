"""The C module below RPi.GPIO, which editors import names from: `from RPi._GPIO import BCM`."""
# ruff: noqa: N999 - the name of the real module

from typing import Any

from minirospy.gpio import rpigpio
from minirospy.gpio.rpigpio import __all__ as __all__


def __getattr__(name: str) -> Any:
    return getattr(rpigpio, name)
