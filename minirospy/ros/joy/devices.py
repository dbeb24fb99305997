"""Accesses joysticks connected to this machine: on Linux through /dev/input/js*, elsewhere through pygame-ce.

Protocol: https://www.kernel.org/doc/html/latest/input/joydev/joystick-api.html.
"""

from __future__ import annotations

import array
import contextlib
import os
import re
import select
import stat
import struct
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from minirospy.base.errors import MinirospyError
from minirospy.base.installation import install_command
from minirospy.ros.joy.joystick import EVENT_AXIS, EVENT_BUTTON, EVENT_INIT, MAX_VALUE, Event
from minirospy.ros.joy.rumble import Rumble, RumbleError, event_device

__all__ = [
    "Device",
    "DeviceError",
    "LinuxDevice",
    "PygameDevice",
    "find_by_name",
    "open_device",
    "state_events",
]

_EVENT = struct.Struct("<IhBB")
_NAME_LENGTH = 128
_FOLDER = Path("/dev/input")
_UNKNOWN = "Unknown"
_POLL_SECONDS = 0.002


class DeviceError(MinirospyError):
    """Raised if the joystick cannot be opened or was disconnected. The message is one line with the reason."""


class Device(Protocol):
    """An open joystick."""

    name: str

    def wait(self, seconds: float) -> Event | None:
        """Return the next event, or None after ``seconds`` without an event. Raise DeviceError if the device is disconnected."""

    def rumble(self, strong: float, weak: float) -> None:
        """Run the motors for one second, each at a power from 0 to 1. Raise RumbleError if the motors cannot be used."""

    def close(self) -> None:
        """Close the device."""


def open_device(path: str, feedback_path: str = "") -> Device:
    """Open a joystick by its path. Outside Linux, use only the number in the path.

    ``feedback_path``: on Linux, the event device that controls the motors, if it differs from the joystick's own. Raise
    DeviceError if the joystick cannot be opened.
    """
    if sys.platform == "linux" or os.path.exists(path):
        return LinuxDevice(path, feedback_path)
    match = re.search(r"\d+$", path)
    return PygameDevice(int(match[0]) if match else 0)


class LinuxDevice:
    """A joystick on Linux: a device file that yields eight bytes per event."""

    def __init__(self, path: str, feedback_path: str = "") -> None:
        self._feedback_path = feedback_path or event_device(path)
        self._motors: Rumble | None = None
        try:
            # Open the device twice: after the first open(), the initial events may report the state at the last close().
            os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK))
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise DeviceError(error.strerror or str(error)) from error
        self.name = _name_of(self._file)
        self._rest = b""

    def wait(self, seconds: float) -> Event | None:
        """Return the next event, or None after ``seconds`` without an event. Raise DeviceError if the device is disconnected."""
        end = time.monotonic() + seconds
        while len(self._rest) < _EVENT.size:
            ready, _, _ = select.select([self._file], [], [], max(end - time.monotonic(), 0))
            if not ready:
                return None
            try:
                read = os.read(self._file, _EVENT.size - len(self._rest))
            except BlockingIOError:
                continue
            except OSError as error:
                raise DeviceError(error.strerror or str(error)) from error
            if not read:
                raise DeviceError("no device is at the other end")
            self._rest += read
        _, value, kind, number = _EVENT.unpack(self._rest)
        self._rest = b""
        return Event(kind, number, value)

    def rumble(self, strong: float, weak: float) -> None:
        """Run the motors for one second, each at a power from 0 to 1. Raise RumbleError if the motors cannot be used."""
        if self._motors is None:
            if not self._feedback_path:
                raise RumbleError(
                    "the joystick has no device for force feedback; _dev_ff:=/dev/input/eventN names one"
                )
            self._motors = Rumble(self._feedback_path)
        self._motors.play(strong, weak)

    def close(self) -> None:
        """Close the device."""
        os.close(self._file)
        if self._motors is not None:
            self._motors.close()
            self._motors = None


def _name_of(file: int) -> str:
    """Return the joystick's name from the kernel (JSIOCGNAME)."""
    if sys.platform == "win32":
        return _UNKNOWN
    import fcntl

    name = array.array("B", bytes(_NAME_LENGTH))
    try:
        fcntl.ioctl(file, 0x80006A13 + (_NAME_LENGTH << 16), name)
    except OSError:
        return _UNKNOWN
    return name.tobytes().partition(b"\0")[0].decode("utf-8", "replace")


def find_by_name(folder: Path = _FOLDER) -> Iterator[tuple[str, str]]:
    """Yield each joystick's name and path on Linux."""
    for path in sorted(folder.glob("js*")):
        try:
            if not stat.S_ISCHR(path.stat().st_mode):
                continue
            file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError:
            continue
        try:
            yield _name_of(file), str(path)
        finally:
            os.close(file)


class PygameDevice:
    """A joystick read through SDL. As on Linux, its hats are reported as additional axes after the other axes.

    Raise DeviceError if the joystick cannot be opened.
    """

    def __init__(self, number: int) -> None:
        os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
        os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame  # type: ignore[import-not-found,unused-ignore]
        except ImportError:
            raise DeviceError(
                f"joysticks need pygame-ce on this system: {install_command('minirospy[joy]')}"
            ) from None
        self._pygame: Any = pygame
        pygame.init()
        # Reinitialize, to find a joystick plugged in since the last initialization.
        pygame.joystick.quit()
        pygame.joystick.init()
        count = pygame.joystick.get_count()
        if number >= count:
            raise DeviceError(f"{count} joysticks are connected: there is no number {number}")
        self._joystick = pygame.joystick.Joystick(number)
        self.name = str(self._joystick.get_name())
        self._known: list[tuple[int, int, int]] = []
        self._events: list[Event] = []

    def wait(self, seconds: float) -> Event | None:
        """Return the next event, or None after ``seconds`` without an event. Raise DeviceError if the device is disconnected."""
        end = time.monotonic() + seconds
        while not self._events:
            self._pygame.event.pump()
            if not self._joystick.get_init() or self._has_gone():
                raise DeviceError("it was unplugged")
            state = self._state()
            self._events += state_events(self._known, state)
            self._known = state
            left = end - time.monotonic()
            if not self._events:
                if left <= 0:
                    return None
                time.sleep(min(_POLL_SECONDS, left))
        return self._events.pop(0)

    def rumble(self, strong: float, weak: float) -> None:
        """Run the motors for one second, each at a power from 0 to 1. Raise RumbleError if the motors cannot be used."""
        if not self._joystick.rumble(min(max(strong, 0.0), 1.0), min(max(weak, 0.0), 1.0), 1000):
            raise RumbleError("the joystick has no motors that SDL knows")

    def _has_gone(self) -> bool:
        removed = self._pygame.event.get(self._pygame.JOYDEVICEREMOVED)
        return any(each.instance_id == self._joystick.get_instance_id() for each in removed)

    def _state(self) -> list[tuple[int, int, int]]:
        stick = self._joystick
        axes = [stick.get_axis(at) for at in range(stick.get_numaxes())]
        for at in range(stick.get_numhats()):
            x, y = stick.get_hat(at)
            axes += (x, -y)
        buttons = [int(stick.get_button(at)) for at in range(stick.get_numbuttons())]
        return [
            *((EVENT_BUTTON, number, value) for number, value in enumerate(buttons)),
            *((EVENT_AXIS, number, round(value * MAX_VALUE)) for number, value in enumerate(axes)),
        ]

    def close(self) -> None:
        """Close the device."""
        with contextlib.suppress(self._pygame.error):
            self._joystick.quit()


def state_events(
    before: Sequence[tuple[int, int, int]], after: Sequence[tuple[int, int, int]]
) -> list[Event]:
    """Return the events that change state ``before`` to ``after``, or the initial events if ``before`` is empty."""
    if not before:
        return [Event(kind | EVENT_INIT, number, value) for kind, number, value in after]
    return [Event(*each) for old, each in zip(before, after, strict=True) if old != each]
