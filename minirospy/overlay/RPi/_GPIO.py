"""The C module below RPi.GPIO, which editors import names from: `from RPi._GPIO import BCM`."""

from minirospy.compat.rpi import __getattr__ as __getattr__
from minirospy.gpio.rpigpio import __all__ as __all__
