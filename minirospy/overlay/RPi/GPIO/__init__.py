"""RPi.GPIO on minirospy's virtual board; an installed RPi.GPIO or rpi-lgpio comes first on sys.path."""

from minirospy.compat import rpi as _rpi  # warns where a Raspberry Pi lacks its library
from minirospy.gpio.rpigpio import BCM as BCM
from minirospy.gpio.rpigpio import BOARD as BOARD
from minirospy.gpio.rpigpio import BOTH as BOTH
from minirospy.gpio.rpigpio import FALLING as FALLING
from minirospy.gpio.rpigpio import HARD_PWM as HARD_PWM
from minirospy.gpio.rpigpio import HIGH as HIGH
from minirospy.gpio.rpigpio import I2C as I2C
from minirospy.gpio.rpigpio import IN as IN
from minirospy.gpio.rpigpio import LOW as LOW
from minirospy.gpio.rpigpio import OUT as OUT
from minirospy.gpio.rpigpio import PUD_DOWN as PUD_DOWN
from minirospy.gpio.rpigpio import PUD_OFF as PUD_OFF
from minirospy.gpio.rpigpio import PUD_UP as PUD_UP
from minirospy.gpio.rpigpio import PWM as PWM
from minirospy.gpio.rpigpio import RISING as RISING
from minirospy.gpio.rpigpio import RPI_INFO as RPI_INFO
from minirospy.gpio.rpigpio import RPI_REVISION as RPI_REVISION
from minirospy.gpio.rpigpio import SERIAL as SERIAL
from minirospy.gpio.rpigpio import SPI as SPI
from minirospy.gpio.rpigpio import UNKNOWN as UNKNOWN
from minirospy.gpio.rpigpio import VERSION as VERSION
from minirospy.gpio.rpigpio import __all__ as __all__
from minirospy.gpio.rpigpio import add_event_callback as add_event_callback
from minirospy.gpio.rpigpio import add_event_detect as add_event_detect
from minirospy.gpio.rpigpio import cleanup as cleanup
from minirospy.gpio.rpigpio import event_detected as event_detected
from minirospy.gpio.rpigpio import getmode as getmode
from minirospy.gpio.rpigpio import gpio_function as gpio_function
from minirospy.gpio.rpigpio import input as input
from minirospy.gpio.rpigpio import output as output
from minirospy.gpio.rpigpio import remove_event_detect as remove_event_detect
from minirospy.gpio.rpigpio import setmode as setmode
from minirospy.gpio.rpigpio import setup as setup
from minirospy.gpio.rpigpio import setwarnings as setwarnings
from minirospy.gpio.rpigpio import wait_for_edge as wait_for_edge
