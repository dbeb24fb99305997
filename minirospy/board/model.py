"""A board's behaviour: apply operations and return the changed pins. Pure.

A pin is an input or an output. An output's level is its latch; an input's level is the one driven from outside (a
pressed button, a jumper wire), else its pull resistor, else 0. As on a Raspberry Pi, the latch does not change if the
direction changes, or if the process that wrote it exits. In front of the board is a scanner, and perhaps a person.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

__all__ = [
    "BUTTONS",
    "LEDS",
    "PINS",
    "BoardModel",
    "Change",
    "Force",
    "Function",
    "Operation",
    "OperationError",
    "Pin",
    "Position",
    "Press",
    "Pull",
    "Release",
    "Setup",
    "Write",
]

PINS = 54  # number of pins on the chip, in BCM numbering: 0 to 53

# dict from BCM pin to the colour of its LED
LEDS = {2: "green", 3: "green", 4: "yellow", 5: "yellow", 6: "red", 7: "red"}

BUTTONS = (11, 12)
"""BCM pins of the wired buttons. A resistor pulls each pin to 0, and pressing the button drives it to 1."""


class Function(IntEnum):
    """A pin's function; the numbers are RPi.GPIO's."""

    OUT = 0
    IN = 1


class Pull(IntEnum):
    """The resistor inside the chip; the numbers are RPi.GPIO's."""

    OFF = 20
    DOWN = 21
    UP = 22


class Pin(NamedTuple):
    """One pin. ``world`` is the level to which it is driven from outside, or None if it is not driven."""

    function: Function = Function.IN
    pull: Pull = Pull.OFF
    world: int | None = None
    latch: int = 0

    @property
    def level(self) -> int:
        """Return the level that is read at the pin: 0 or 1."""
        if self.function is Function.OUT:
            return self.latch
        if self.world is not None:
            return self.world
        return 1 if self.pull is Pull.UP else 0


class Setup(NamedTuple):
    """An operation that sets a pin's function. ``initial`` is an output's first level, or None to keep the latch."""

    pin: int
    function: int
    pull: int = Pull.OFF
    initial: int | None = None


class Write(NamedTuple):
    """An operation that sets the latches of several pins together: ((pin, level), ...)."""

    levels: Sequence[Sequence[int]]


class Press(NamedTuple):
    """An operation that presses the button at ``pin``."""

    pin: int


class Release(NamedTuple):
    """An operation that releases the button at ``pin``."""

    pin: int


class Force(NamedTuple):
    """An operation that, from outside of the program, drives an input to ``level`` or sets an output's latch."""

    pin: int
    level: int


Operation = Setup | Write | Press | Release | Force

Position = tuple[float, float]  # distances in metres: ahead of the scanner, and to its left


class Change(NamedTuple):
    """``pin`` is now in ``state``; ``edge`` is true if its level changed."""

    pin: int
    state: Pin
    edge: bool


class OperationError(ValueError):
    """An operation has an invalid pin, level, function, pull or position."""


class BoardModel:
    """All pins on one board, and the person in front of it."""

    def __init__(self, pins: Sequence[Pin] | None = None, person: Position | None = None) -> None:
        fresh = [Pin(world=0 if number in BUTTONS else None) for number in range(PINS)]
        self.pins: list[Pin] = list(pins) if pins is not None else fresh
        self.person = person

    def apply(self, operation: Operation) -> list[Change]:
        """Perform one operation completely and return the changed pins.

        If the operation is invalid, raise OperationError and change nothing.
        """
        match operation:
            case Setup(pin, function, pull, initial):
                wanted = self._set_up(_pin(pin), function, pull, initial)
            case Write(levels):
                wanted = {_pin(pin): self.pins[pin]._replace(latch=_level(level)) for pin, level in levels}
            case Press(pin):
                wanted = {_pin(pin): self.pins[pin]._replace(world=self._pressed(pin))}
            case Release(pin):
                wanted = {_pin(pin): self.pins[pin]._replace(world=0 if pin in BUTTONS else None)}
            case Force(pin, level):
                before = self.pins[_pin(pin)]
                if before.function is Function.OUT:
                    wanted = {pin: before._replace(latch=_level(level))}
                else:
                    wanted = {pin: before._replace(world=_level(level))}

        changes = []

        for pin, state in wanted.items():
            before = self.pins[pin]
            if state != before:
                self.pins[pin] = state
                changes.append(Change(pin, state, state.level != before.level))

        return changes

    def move_person(self, position: Position | None) -> bool:
        """Set the person's position (None: no person); return whether it changed. Raise OperationError if it is invalid."""
        if position is not None and not all(map(math.isfinite, position)):
            raise OperationError(f"a position is two lengths in metres, not {position}")
        moved = position != self.person
        self.person = position
        return moved

    def _set_up(self, pin: int, function: int, pull: int, initial: int | None) -> dict[int, Pin]:
        try:
            state = self.pins[pin]._replace(function=Function(function), pull=Pull(pull))
        except ValueError as error:
            raise OperationError(str(error)) from error
        return {pin: state if initial is None else state._replace(latch=_level(initial))}

    def _pressed(self, pin: int) -> int:
        # A button connects a pin with a pull-up to ground, and one of the wired buttons connects its pin to 3.3 V.
        return 0 if pin not in BUTTONS and self.pins[pin].pull is Pull.UP else 1


def _pin(pin: int) -> int:
    if not (isinstance(pin, int) and 0 <= pin < PINS):
        raise OperationError(f"pin {pin!r} does not exist: BCM numbers are 0 to {PINS - 1}")
    return pin


def _level(level: int) -> int:
    if not isinstance(level, int) or level not in {0, 1}:
        raise OperationError(f"a level is 0 or 1, not {level!r}")
    return int(level)
