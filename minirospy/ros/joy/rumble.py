"""Runs a joystick's motors on Linux, through its event device's force feedback and the kernel's structs.

Source: https://www.kernel.org/doc/html/latest/input/ff.html, linux/input.h.
"""

from __future__ import annotations

import array
import os
import struct
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.errors import MinirospyError

__all__ = ["Rumble", "RumbleError", "event_device", "pack_effect", "pack_event"]

_EV_FF = 0x15
_FF_RUMBLE = 0x50
_FF_GAIN = 0x60
_MAX_MAGNITUDE = 0xFFFF
_MILLISECONDS = 1000  # effect duration; joy_node restarts the effect before it ends

# struct ff_effect: type, ID, direction, trigger (2), replay (length, delay); both magnitudes at byte 16.
_EFFECT = struct.Struct("=HhHHHHHxxHH")
_EFFECT_SIZE = 48 if struct.calcsize("P") == 8 else 44
_EVIOCSFF = 0x40004580 | _EFFECT_SIZE << 16
_ID_AT = 2

_INPUT = Path("/sys/class/input")


class RumbleError(MinirospyError):
    """Raised if the joystick's motors cannot be used. The message is one line with the reason."""


def event_device(joystick: str, folder: Path = _INPUT) -> str:
    """Return the event device of the joystick at a path such as `/dev/input/js0`, or "" if there is none."""
    found = sorted((folder / Path(joystick).name / "device").glob("event*"))
    return f"/dev/input/{found[0].name}" if found else ""


def pack_effect(number: int, strong: float, weak: float) -> bytes:
    """Return a struct ff_effect with each motor's power, from 0 to 1. ``number`` is the effect's ID, or -1 for a new effect."""
    low, high = (round(min(max(share, 0.0), 1.0) * _MAX_MAGNITUDE) for share in (strong, weak))
    fields = _EFFECT.pack(_FF_RUMBLE, number, 0, 0, 0, _MILLISECONDS, 0, low, high)
    return fields + bytes(_EFFECT_SIZE - len(fields))


def pack_event(code: int, value: int) -> bytes:
    """Return a struct input_event that plays the effect with the ID ``code``, or sets the gain if ``code`` is _FF_GAIN."""
    return struct.pack("@llHHi", 0, 0, _EV_FF, code, value)


class Rumble:
    """An event device's motors. All methods raise RumbleError if the motors do not work."""

    def __init__(self, path: str) -> None:
        self._path = path
        try:
            self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK)
        except OSError as error:
            raise self._error(error) from error
        try:
            self._number = self._upload(-1, (0, 0))
            os.write(self._file, pack_event(_FF_GAIN, _MAX_MAGNITUDE))
        except OSError as error:
            os.close(self._file)
            raise self._error(error) from error

    def play(self, strong: float, weak: float) -> None:
        """Run the motors for one second, each at a power from 0 to 1."""
        try:
            self._upload(self._number, (strong, weak))
            os.write(self._file, pack_event(self._number, 1))
        except OSError as error:
            raise self._error(error) from error

    def close(self) -> None:
        """Close the device, which also stops its motors."""
        os.close(self._file)

    def _upload(self, number: int, magnitudes: Sequence[float]) -> int:
        import fcntl

        # The ioctl writes a new effect's ID into this array.
        effect = array.array("B", pack_effect(number, *magnitudes))
        fcntl.ioctl(self._file, _EVIOCSFF, effect)
        found: int = struct.unpack_from("=h", effect, _ID_AT)[0]
        return found

    def _error(self, error: OSError) -> RumbleError:
        return RumbleError(f"{self._path} takes no force feedback: {error.strerror or error}")
