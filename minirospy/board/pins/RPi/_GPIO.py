"""The counterpart of RPi.GPIO's C module. Editors import names from it: `from RPi._GPIO import BCM`."""

from minirospy.board.rpi import __getattr__ as __getattr__
from minirospy.board.rpigpio import __all__ as __all__
