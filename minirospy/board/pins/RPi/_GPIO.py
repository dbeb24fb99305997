"""The C module below RPi.GPIO, which editors import names from: `from RPi._GPIO import BCM`."""

from minirospy.board.rpi import __getattr__ as __getattr__
from minirospy.board.rpigpio import __all__ as __all__
