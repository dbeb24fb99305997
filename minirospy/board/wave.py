"""A PWM's square wave on the virtual board."""

from __future__ import annotations

import contextlib
import threading
from typing import Protocol

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import BoardError

__all__ = ["PWM_LIMIT", "Wave"]

PWM_LIMIT = 50.0  # Hz; the board shows faster PWMs at this frequency, with their own duty cycles


class Output(Protocol):
    """The interface through which a wave controls its output channel."""

    def write(self, pin: int, level: int) -> None:
        """Set the level at a pin."""

    def register_wave(self, wave: Wave) -> None:
        """Record that ``wave`` uses the pin ``wave.pin``."""

    def unregister_wave(self, wave: Wave) -> None:
        """Release the pin of ``wave``, so that another wave may use it."""


class Wave:
    """One PWM's square wave, generated in a separate thread."""

    def __init__(self, gpio: Output, pin: int, frequency: float) -> None:
        self.pin = pin
        self._gpio = gpio
        self._frequency = frequency
        self._duty = 0.0
        self._changed = SignalSafeEvent()
        self._stopping = False
        self._thread: threading.Thread | None = None
        gpio.register_wave(self)

    def set(self, *, duty: float | None = None, frequency: float | None = None) -> None:
        """Change the duty cycle (in percent) or the frequency (in Hz)."""
        if duty is not None:
            if not 0.0 <= duty <= 100.0:
                raise ValueError("dutycycle must have a value from 0.0 to 100.0")
            self._duty = float(duty)
        if frequency is not None:
            if not frequency > 0.0:
                raise ValueError("frequency must be greater than 0.0")
            self._frequency = float(frequency)
        self._changed.set()

    def start(self) -> None:
        """Start the wave, for the first time or again after stop()."""
        if self._thread is None:
            self._stopping = False
            self._gpio.register_wave(self)
            self._thread = threading.Thread(target=self._run, name=f"gpio-pwm-{self.pin}", daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """Stop the wave and set the pin low; another PWM may then use the pin."""
        thread, self._thread = self._thread, None
        self._stopping = True
        self._changed.set()
        if thread is not None and thread is not threading.current_thread():
            thread.join(1.0)
        self._gpio.unregister_wave(self)

    def _run(self) -> None:
        # If the board is gone, there is no pin to modulate.
        with contextlib.suppress(BoardError):
            while not self._stopping:
                self._changed.clear()
                period = 1.0 / min(self._frequency, PWM_LIMIT)
                high = period * self._duty / 100.0
                if high > 0.0:
                    self._gpio.write(self.pin, 1)
                    self._changed.wait(high if high < period else None)
                if high < period and not self._stopping:
                    self._gpio.write(self.pin, 0)
                    self._changed.wait(period - high if high > 0.0 else None)
            self._gpio.write(self.pin, 0)
