"""RPi.GPIO on minirospy's virtual board; an installed RPi.GPIO or rpi-lgpio comes first on sys.path."""
# ruff: noqa: N999 - the name of the real package

from minirospy.gpio.raspberry import warn_of_missing_library
from minirospy.gpio.rpigpio import *  # noqa: F403
from minirospy.gpio.rpigpio import __all__ as __all__

warn_of_missing_library()
