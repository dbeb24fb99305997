"""Explain why a program's GPIO pin has no effect: the virtual board has no part, or a different one, at that pin."""

from __future__ import annotations

from minirospy.board.model import BUTTONS, LEDS, Function

__all__ = ["wiring_fault"]

_PARTS = f"its LEDs are at {min(LEDS)} to {max(LEDS)}, its buttons at {' and '.join(map(str, BUTTONS))} (BCM numbers)"


def wiring_fault(channel: int, pin: int, direction: int, *, is_board: bool) -> str:
    """Return the reason why using BCM ``pin`` in this direction has no effect, or "" if it has an effect.

    ``channel`` is the number that the program uses; ``is_board`` means that it is a GPIO.BOARD number.
    """
    is_output = direction == Function.OUT
    if pin in LEDS or (pin in BUTTONS and not is_output):
        return ""
    name = f"{channel} with GPIO.BOARD is GPIO {pin}" if is_board else f"GPIO {pin}"
    if pin in BUTTONS:
        return f"{name} is a button: as an output it reads no press, and on a real board a press is a short circuit"
    if is_board and (channel in LEDS or channel in BUTTONS):
        return f"nothing is wired: {name}; with GPIO.setmode(GPIO.BCM), {channel} is a part of the board"
    # An input without a wired part is fine, because `minirospy board press` can drive every input.
    return f"nothing is wired to {name}: {_PARTS}" if is_output else ""
