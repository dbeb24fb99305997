"""The module for `import RPi.GPIO as GPIO`: the API of RPi.GPIO 0.7.1 on the virtual board.

Names, defaults, error messages and warnings are RPi.GPIO's (https://sourceforge.net/p/raspberry-gpio-python/wiki/). The
import does not connect to the board; the first call that needs the board does. As on hardware, the pins keep their
state when the process exits; only cleanup() resets them.
"""

from __future__ import annotations

import atexit
import operator
import threading
import time
import warnings
import weakref
from collections.abc import Sequence

from minirospy.base.notes import noted
from minirospy.base.signal_dispatch import is_dispatching_signal
from minirospy.board.arguments import NO_BOUNCETIME, channels_of, detector_of, level_of
from minirospy.board.directory import BoardDirectory
from minirospy.board.events import Callback, CallbackThread, Detector, Slope
from minirospy.board.link import Edge, Link
from minirospy.board.model import PINS, Function, Pull, Setup
from minirospy.board.wave import Wave
from minirospy.board.wiring import wiring_fault

__all__ = [
    "BCM",
    "BOARD",
    "BOTH",
    "FALLING",
    "HARD_PWM",
    "HIGH",
    "I2C",
    "IN",
    "LOW",
    "OUT",
    "PUD_DOWN",
    "PUD_OFF",
    "PUD_UP",
    "PWM",
    "RISING",
    "RPI_INFO",
    "RPI_REVISION",
    "SERIAL",
    "SPI",
    "UNKNOWN",
    "VERSION",
    "add_event_callback",
    "add_event_detect",
    "cleanup",
    "event_detected",
    "getmode",
    "gpio_function",
    "input",
    "output",
    "remove_event_detect",
    "setmode",
    "setup",
    "setwarnings",
    "wait_for_edge",
]

LOW, HIGH = 0, 1
OUT, IN = int(Function.OUT), int(Function.IN)
BOARD, BCM = 10, 11
PUD_OFF, PUD_DOWN, PUD_UP = int(Pull.OFF), int(Pull.DOWN), int(Pull.UP)
RISING, FALLING, BOTH = int(Slope.RISING), int(Slope.FALLING), int(Slope.BOTH)
SERIAL, SPI, I2C, HARD_PWM, UNKNOWN = 40, 41, 42, 43, -1
VERSION = "0.7.1"
RPI_REVISION = 3
RPI_INFO = {
    "P1_REVISION": 3,
    "REVISION": "0000",
    "TYPE": "Virtual board",
    "MANUFACTURER": "minirospy",
    "PROCESSOR": "Unknown",
    "RAM": "Unknown",
}

HEADER = {
    3: 2,
    5: 3,
    7: 4,
    8: 14,
    10: 15,
    11: 17,
    12: 18,
    13: 27,
    15: 22,
    16: 23,
    18: 24,
    19: 10,
    21: 9,
    22: 25,
    23: 11,
    24: 8,
    26: 7,
    29: 5,
    31: 6,
    32: 12,
    33: 13,
    35: 19,
    36: 16,
    37: 26,
    38: 20,
    40: 21,
}
"""Dict from pin on the 40-pin header (BOARD numbering) to BCM pin."""


class Gpio:
    """The board as one program uses it: its numbering mode, the pins that it has set up, and its events."""

    def __init__(self, board: str | None = None) -> None:
        self._board = board
        self._lock = threading.RLock()
        self._mode: int | None = None
        self._warns = True
        self._reported: set[int] = set()  # channels that a wiring warning has already named
        self._link: Link | None = None
        self._levels: list[int] = []
        self._directions: dict[int, int] = {}
        # BCM pins keyed by channel, for the channels that are set up. input() and output(), which must be fast, use this dict.
        self._readable: dict[int, int] = {}
        self._writable: dict[int, int] = {}
        # The channels that cleanup() released in a signal handler, with their BCM pins: the interrupted call may still use them.
        self._interrupted: dict[int, int] = {}
        self._detectors: dict[int, Detector] = {}
        self._waiting: dict[int, Detector] = {}
        self._callbacks: CallbackThread | None = None
        self._waves: dict[int, weakref.ref[Wave]] = {}

    def setmode(self, mode: int) -> None:
        """Choose the pin numbering: BCM (chip) or BOARD (header)."""
        try:
            mode = operator.index(mode)
        except TypeError as error:
            noted(error, "the modes are GPIO.BCM and GPIO.BOARD, without quotes")
            raise
        if self._mode is not None and mode != self._mode:
            raise ValueError("A different mode has already been set!")
        if mode not in {BOARD, BCM}:
            raise ValueError("An invalid mode was passed to setmode()")
        self._mode = mode
        self._interrupted.clear()

    def getmode(self) -> int | None:
        """Return the numbering mode: BCM, BOARD, or None if it is not set."""
        return self._mode

    def setwarnings(self, flag: bool) -> None:
        """Set whether RuntimeWarnings are issued."""
        self._warns = bool(flag)

    def setup(
        self, channel: int | Sequence[int], direction: int, pull_up_down: int = PUD_OFF, initial: int = -1
    ) -> None:
        """Configure one or several channels as input or output."""
        try:
            direction, pull_up_down, initial = map(operator.index, (direction, pull_up_down, initial))
        except TypeError as error:
            noted(error, "the directions are GPIO.IN and GPIO.OUT, without quotes")
            raise
        if direction not in {IN, OUT}:
            raise ValueError("An invalid direction was passed to setup()")
        if direction == OUT and pull_up_down != PUD_OFF:
            raise ValueError("pull_up_down parameter is not valid for outputs")
        if direction == IN and initial != -1:
            raise ValueError("initial parameter is not valid for inputs")
        if pull_up_down not in {PUD_OFF, PUD_DOWN, PUD_UP}:
            raise ValueError("Invalid value for pull_up_down - should be either PUD_OFF, PUD_UP or PUD_DOWN")
        level = initial if initial in {LOW, HIGH} else None
        for one in channels_of(channel):
            self._set_up(one, direction, pull_up_down, level)

    def output(self, channel: int | Sequence[int], value: int | bool | Sequence[int | bool]) -> None:
        """Set output channels. A single value applies to all of them."""
        try:
            # Try the usual case first: one channel, one value.
            pin = self._writable[channel]  # type: ignore[index]
            level = level_of(value)
        except (KeyError, TypeError):
            pass
        else:
            self._linked().write(((pin, level),))
            return
        # Call this outside the except block, so that an error is not shown as raised while handling a KeyError.
        self._output_several(channel, value)

    def input(self, channel: int) -> int:
        """Return the level at a configured channel, output or input: 0 or 1."""
        try:
            return self._levels[self._readable[channel]]
        except (KeyError, TypeError):
            if (interrupted := self._interrupted.pop(channel, None)) is not None:
                return self._levels[interrupted]
        self._pin(channel)
        error = RuntimeError("You must setup() the GPIO channel first")
        raise noted(error, f"channel {channel}: call GPIO.setup({channel}, GPIO.IN) before")

    def gpio_function(self, channel: int) -> int:
        """Return the current function of the channel's pin: IN or OUT."""
        pin = self._pin(channel)
        return int(self._linked().states[pin].function)

    def cleanup(self, channel: int | Sequence[int] | None = None) -> None:
        """Reset this program's channels to inputs; without an argument, also reset the numbering mode."""
        with self._lock:
            everything = channel is None
            wanted = (
                set(self._directions) if channel is None else {self._pin(one) for one in channels_of(channel)}
            )
            mine = wanted & set(self._directions)
            if is_dispatching_signal():
                # In a shutdown hook: the interrupted program may already have checked its stop flag, and be about to use a pin.
                # That use must not fail, because with RPi.GPIO it cannot: its calls are in C, and finish before a hook runs.
                self._interrupted.update((one, pin) for one, pin in self._readable.items() if pin in mine)

            for pin in sorted(mine):
                self._forget_events(pin)
                self._linked().call(Setup(pin, IN))
                self._directions.pop(pin, None)

            for table in (self._readable, self._writable):
                for one in [one for one, pin in table.items() if pin in mine]:
                    del table[one]

            if everything and self._link is not None:
                # Like RPi.GPIO, reset the mode if any pin has been accessed, even if no channel was set up.
                self._mode = None

        if not mine:
            self._warn(
                "No channels have been set up yet - nothing to clean up!  "
                "Try cleaning up at the end of your program instead!",
                depth=2,
            )

    def add_event_detect(
        self,
        gpio: int | None = None,
        edge: int | None = None,
        callback: Callback | None = None,
        bouncetime: int = NO_BOUNCETIME,
        *,
        channel: int | None = None,
    ) -> None:
        """Detect edges on an input; ``callback(channel)`` is called for each. ``bouncetime`` is in ms."""
        number = gpio if gpio is not None else channel
        if number is None or edge is None:
            raise TypeError("add_event_detect() needs a channel and an edge")
        if callback is not None and not callable(callback):
            raise TypeError("Parameter must be callable")
        pin = self._input_pin(number)
        detector = detector_of(number, edge, bouncetime)

        with self._lock:
            if pin in self._detectors:
                raise RuntimeError("Conflicting edge detection already enabled for this GPIO channel")
            if callback is not None:
                self._start_callbacks()
                detector.callbacks.append(callback)
            self._detectors[pin] = detector

    def add_event_callback(self, gpio: int, callback: Callback) -> None:
        """Add a callback for a channel on which add_event_detect was called."""
        if not callable(callback):
            raise TypeError("Parameter must be callable")
        pin = self._input_pin(gpio)
        with self._lock:
            if pin not in self._detectors:
                raise RuntimeError(
                    "Add event detection using add_event_detect first before adding a callback"
                )
            self._start_callbacks()
            self._detectors[pin].callbacks.append(callback)

    def wait_for_edge(
        self, channel: int, edge: int, bouncetime: int = NO_BOUNCETIME, timeout: int = -1
    ) -> int | None:
        """Wait for an edge, up to ``timeout`` ms (-1: forever); return the channel, or None after the timeout."""
        pin = self._input_pin(channel)
        detector = detector_of(channel, edge, bouncetime)
        if operator.index(timeout) <= 0 and timeout != -1:
            raise ValueError("Timeout must be greater than 0")
        with self._lock:
            existing = self._detectors.get(pin)
            if pin in self._waiting or (existing is not None and existing.excludes(detector)):
                raise RuntimeError("Conflicting edge detection events already exist for this GPIO channel")
            self._waiting[pin] = detector
        try:
            return channel if detector.wait(None if timeout == -1 else timeout / 1000) else None
        finally:
            with self._lock:
                self._waiting.pop(pin, None)

    def event_detected(self, channel: int) -> bool:
        """Return whether an edge on the channel has occurred since the last call."""
        detector = self._detectors.get(self._pin(channel))
        return detector is not None and detector.take()

    def remove_event_detect(self, gpio: int) -> None:
        """Stop detecting edges on a channel; callbacks that have not started will not run."""
        with self._lock:
            self._forget_events(self._pin(gpio))

    def close(self) -> None:
        """Disconnect; the pins keep their state, except those with a running PWM, which become low."""
        for reference in list(self._waves.values()):
            wave = reference()
            if wave is not None:
                wave.stop()
        with self._lock:
            callbacks, self._callbacks = self._callbacks, None
            link, self._link = self._link, None
        if callbacks is not None:
            callbacks.close()
        if link is not None:
            link.close()
        atexit.unregister(self.close)

    def output_pin(self, channel: int) -> int:
        """Return the BCM pin of a PWM's channel. Raise the same exceptions as PWM()."""
        pin = self._pin(channel)
        if pin in self._waves:
            raise RuntimeError("A PWM object already exists for this GPIO channel")
        if self._directions.get(pin) != OUT:
            error = RuntimeError("You must setup() the GPIO channel as an output first")
            raise noted(error, f"channel {channel}: call GPIO.setup({channel}, GPIO.OUT) before")
        return pin

    def register_wave(self, wave: Wave) -> None:
        """Record that a PWM uses a pin."""
        self._waves[wave.pin] = weakref.ref(wave)

    def unregister_wave(self, wave: Wave) -> None:
        """Release the pin for another PWM."""
        self._waves.pop(wave.pin, None)

    def write(self, pin: int, level: int) -> None:
        """Set a BCM pin's latch."""
        self._linked().write(((pin, level),))

    def _linked(self) -> Link:
        link = self._link
        if link is not None:
            return link
        with self._lock:
            if self._link is None:
                self._link = Link(BoardDirectory.find(self._board), self._on_edge)
                self._levels = self._link.levels
                atexit.register(self.close)
            return self._link

    def _pin(self, channel: int) -> int:
        if self._mode is None:
            raise noted(
                RuntimeError(
                    "Please set pin numbering mode using GPIO.setmode(GPIO.BOARD) or GPIO.setmode(GPIO.BCM)"
                ),
                "the numbers on the workshop's board are those of GPIO.setmode(GPIO.BCM)",
            )
        if not isinstance(channel, int):
            raise noted(TypeError("Channel must be an integer"), f"it is {channel!r}")
        pin = channel if self._mode == BCM else HEADER.get(channel, -1)
        if not 0 <= pin < PINS:
            raise noted(
                ValueError("The channel sent is invalid on a Raspberry Pi"),
                f"it is {channel}, with the numbers of GPIO.{'BCM' if self._mode == BCM else 'BOARD'}",
            )
        return pin

    def _input_pin(self, channel: int) -> int:
        pin = self._pin(channel)
        if self._directions.get(pin) != IN:
            error = RuntimeError("You must setup() the GPIO channel as an input first")
            raise noted(error, f"channel {channel}: call GPIO.setup({channel}, GPIO.IN) before")
        return pin

    def _set_up(self, channel: int, direction: int, pull: int, level: int | None) -> None:
        pin = self._pin(channel)
        link = self._linked()
        self._check_wiring(channel, pin, direction)
        if pin not in self._directions and link.states[pin].function is Function.OUT:
            self._warn(
                "This channel is already in use, continuing anyway.  "
                "Use GPIO.setwarnings(False) to disable warnings.",
                depth=3,
            )

        if pin in {2, 3} and pull != PUD_OFF:
            self._warn("A physical pull up resistor is fitted on this channel!", depth=3)
        with self._lock:
            # Record the pin before calling the board: Ctrl-C may interrupt the call, and cleanup() must then undo its effect.
            self._directions[pin] = direction

        link.call(Setup(pin, direction, pull, level))

        with self._lock:
            if pin not in self._directions:
                # A signal handler called cleanup() during the call to the board.
                return
            self._interrupted.pop(channel, None)
            self._readable[channel] = pin
            if direction == OUT:
                self._writable[channel] = pin
            else:
                self._writable.pop(channel, None)

    def _output_several(self, channel: object, value: object) -> None:
        if isinstance(channel, int) and self._interrupted.pop(channel, None) is not None:
            return
        channels = channels_of(channel)
        several = isinstance(value, (list, tuple))
        values = list(value) if isinstance(value, (list, tuple)) else [value] * len(channels)
        if len(channels) != len(values) or (several and not isinstance(channel, (list, tuple))):
            raise RuntimeError("Number of channels != number of values")

        try:
            levels = [level_of(one) for one in values]
        except TypeError:
            wrong_value = ValueError(
                "Value must be an integer or boolean"
                if several
                else "Value must be an integer/boolean or a list/tuple of integers/booleans"
            )
            raise noted(
                wrong_value, f"it is {value!r}; write GPIO.HIGH or GPIO.LOW, without quotes"
            ) from None

        pins = [self._pin(one) for one in channels]
        for one, pin in zip(channels, pins, strict=True):
            if self._directions.get(pin) != OUT:
                error = RuntimeError("The GPIO channel has not been set up as an OUTPUT")
                raise noted(error, f"channel {one}: call GPIO.setup({one}, GPIO.OUT) before")
        self._linked().write(list(zip(pins, levels, strict=True)))

    def _forget_events(self, pin: int) -> None:
        detector = self._detectors.pop(pin, None)
        if detector is not None:
            detector.active = False

    def _start_callbacks(self) -> None:
        if self._callbacks is None:
            self._callbacks = CallbackThread()

    def _on_edge(self, edge: Edge) -> None:
        now = time.monotonic()
        waiting = self._waiting.get(edge.pin)
        if waiting is not None:
            waiting.see(edge.level, now)
        detector = self._detectors.get(edge.pin)
        if detector is not None and detector.see(edge.level, now) and detector.callbacks:
            callbacks = self._callbacks
            if callbacks is not None:
                callbacks.schedule(detector)

    def _check_wiring(self, channel: int, pin: int, direction: int) -> None:
        """Warn, once per channel, if the channel's setup has no effect on the virtual board.

        ``setwarnings(False)`` does not suppress the warning, because most listings start with that call.
        """
        fault = wiring_fault(channel, pin, direction, is_board=self._mode == BOARD)
        if fault and channel not in self._reported:
            self._reported.add(channel)
            warnings.warn(f"virtual board: {fault}", RuntimeWarning, stacklevel=4)

    def _warn(self, text: str, depth: int) -> None:
        """Issue a warning that names the line of user code ``depth`` calls above this function."""
        if self._warns:
            warnings.warn(text, RuntimeWarning, stacklevel=depth + 1)


_gpio = Gpio()


class PWM:
    """Pulse width modulation on an output channel; ``frequency`` is in Hz.

    As in RPi.GPIO, it stops when stop() is called or the object is deleted: keep a reference to it.
    """

    def __init__(self, channel: int, frequency: float) -> None:
        self._wave: Wave | None = None
        pin = _gpio.output_pin(channel)
        if not frequency > 0.0:
            raise ValueError("frequency must be greater than 0.0")
        self._wave = Wave(_gpio, pin, frequency)

    def start(self, dutycycle: float) -> None:
        """Start with a duty cycle of ``dutycycle`` percent."""
        self.ChangeDutyCycle(dutycycle)
        self._running.start()

    def ChangeDutyCycle(self, dutycycle: float) -> None:  # noqa: N802 - RPi.GPIO's name
        """Set the duty cycle, 0.0 to 100.0 percent."""
        self._running.set(duty=dutycycle)

    def ChangeFrequency(self, frequency: float) -> None:  # noqa: N802 - RPi.GPIO's name
        """Set the frequency in Hz; it must be above 0.0."""
        self._running.set(frequency=frequency)

    def stop(self) -> None:
        """Stop the wave and set the channel low."""
        self._running.stop()

    @property
    def _running(self) -> Wave:
        assert self._wave is not None
        return self._wave

    def __del__(self) -> None:
        if self._wave is not None:
            self._wave.stop()


setmode = _gpio.setmode
getmode = _gpio.getmode
setwarnings = _gpio.setwarnings
setup = _gpio.setup
output = _gpio.output
input = _gpio.input
gpio_function = _gpio.gpio_function
cleanup = _gpio.cleanup
add_event_detect = _gpio.add_event_detect
add_event_callback = _gpio.add_event_callback
wait_for_edge = _gpio.wait_for_edge
event_detected = _gpio.event_detected
remove_event_detect = _gpio.remove_event_detect
