"""RPi.GPIO on minirospy's virtual board; an installed RPi.GPIO or rpi-lgpio comes first on sys.path."""

from minirospy.board import rpi as _rpi  # warns where a Raspberry Pi lacks its library
from minirospy.board.rpigpio import BCM as BCM
from minirospy.board.rpigpio import BOARD as BOARD
from minirospy.board.rpigpio import BOTH as BOTH
from minirospy.board.rpigpio import FALLING as FALLING
from minirospy.board.rpigpio import HARD_PWM as HARD_PWM
from minirospy.board.rpigpio import HIGH as HIGH
from minirospy.board.rpigpio import I2C as I2C
from minirospy.board.rpigpio import IN as IN
from minirospy.board.rpigpio import LOW as LOW
from minirospy.board.rpigpio import OUT as OUT
from minirospy.board.rpigpio import PUD_DOWN as PUD_DOWN
from minirospy.board.rpigpio import PUD_OFF as PUD_OFF
from minirospy.board.rpigpio import PUD_UP as PUD_UP
from minirospy.board.rpigpio import PWM as PWM
from minirospy.board.rpigpio import RISING as RISING
from minirospy.board.rpigpio import RPI_INFO as RPI_INFO
from minirospy.board.rpigpio import RPI_REVISION as RPI_REVISION
from minirospy.board.rpigpio import SERIAL as SERIAL
from minirospy.board.rpigpio import SPI as SPI
from minirospy.board.rpigpio import UNKNOWN as UNKNOWN
from minirospy.board.rpigpio import VERSION as VERSION
from minirospy.board.rpigpio import __all__ as __all__
from minirospy.board.rpigpio import add_event_callback as add_event_callback
from minirospy.board.rpigpio import add_event_detect as add_event_detect
from minirospy.board.rpigpio import cleanup as cleanup
from minirospy.board.rpigpio import event_detected as event_detected
from minirospy.board.rpigpio import getmode as getmode
from minirospy.board.rpigpio import gpio_function as gpio_function
from minirospy.board.rpigpio import input as input
from minirospy.board.rpigpio import output as output
from minirospy.board.rpigpio import remove_event_detect as remove_event_detect
from minirospy.board.rpigpio import setmode as setmode
from minirospy.board.rpigpio import setup as setup
from minirospy.board.rpigpio import setwarnings as setwarnings
from minirospy.board.rpigpio import wait_for_edge as wait_for_edge
