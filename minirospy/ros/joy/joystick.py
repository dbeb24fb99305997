"""joy_node's publishing rules: converts events and times to messages. Pure: the clock is an argument, in seconds.

Source: http://wiki.ros.org/joy. Button events are published immediately. Axis events, and a device's initial events, are
published after ``coalesce_interval``. If ``autorepeat_rate`` is set, the state is republished while no event occurs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

__all__ = ["EVENT_AXIS", "EVENT_BUTTON", "EVENT_INIT", "Event", "Joystick", "JoystickOptions"]

EVENT_BUTTON, EVENT_AXIS, EVENT_INIT = 0x01, 0x02, 0x80
"""Event types in Linux's struct js_event. Devices on other systems use the same values."""

MAX_VALUE = 32767.0
_FIRST_SECONDS = 1.0  # seconds to add to the first repetition interval after opening the device, as in ROS


class Event(NamedTuple):
    """A change of a button or axis. ``type``: EVENT_*; ``number``: its index; ``value``: 0 or 1, or -32767 to 32767."""

    type: int
    number: int
    value: int


@dataclass(frozen=True)
class JoystickOptions:
    """The node's parameters. ``deadzone`` is a fraction of an axis's range, rates are in Hz (0: none), intervals in seconds."""

    deadzone: float = 0.05
    autorepeat_rate: float = 0.0
    coalesce_interval: float = 0.001
    default_trig_val: bool = False
    sticky_buttons: bool = False

    def checked(self) -> tuple[JoystickOptions, list[str]]:
        """Return the options clamped to their limits, and the warnings of ROS's joy_node about clamped options."""
        warnings = []
        deadzone, rate, interval = self.deadzone, self.autorepeat_rate, self.coalesce_interval
        if interval and rate > 1 / interval:
            warnings.append(
                f"joy_node: autorepeat_rate ({rate:f} Hz) > 1/coalesce_interval ({1 / interval:f} Hz) does not make sense. "
                "Timing behavior is not well defined."
            )
        if deadzone >= 1:
            warnings.append(
                "joy_node: deadzone greater than 1 was requested. The semantics of deadzone have changed. It is now related to "
                "the range [-1:1] instead of [-32767:32767]. For now I am dividing your deadzone by 32767, but this behavior is "
                "deprecated so you need to update your launch file."
            )
            deadzone /= MAX_VALUE
        if deadzone > 0.9:
            warnings.append(f"joy_node: deadzone ({deadzone:f}) greater than 0.9, setting it to 0.9")
            deadzone = 0.9
        if deadzone < 0:
            warnings.append(f"joy_node: deadzone_ ({deadzone:f}) less than 0, setting to 0.")
            deadzone = 0.0
        if rate < 0:
            warnings.append(f"joy_node: autorepeat_rate ({rate:f}) less than 0, setting to 0.")
            rate = 0.0
        if interval < 0:
            warnings.append(f"joy_node: coalesce_interval ({interval:f}) less than 0, setting to 0.")
            interval = 0.0

        limited = replace(self, deadzone=deadzone, autorepeat_rate=rate, coalesce_interval=interval)
        return limited, warnings


class Joystick:
    """Tracks a device's state from its events."""

    def __init__(self, options: JoystickOptions, now: float) -> None:
        self._options = options
        self._scale = -1.0 / (1.0 - options.deadzone) / MAX_VALUE
        self._is_pending = False
        self.axes: list[float] = []
        self.buttons: list[int] = []
        self._published(now + _FIRST_SECONDS)

    deadline: float | None
    """The time at which to publish the state if no event occurs; None to publish only on events."""

    def handle(self, event: Event, now: float) -> bool:
        """Process an event; return whether to publish the state immediately. Raise ValueError if the event's type is unknown."""
        is_initial = bool(event.type & EVENT_INIT)
        kind = event.type & ~EVENT_INIT
        if kind == EVENT_BUTTON:
            self._set_button(event)
        elif kind == EVENT_AXIS:
            self._set_axis(event, is_initial)
        else:
            raise ValueError(
                f"unknown type {event.type:X}h of an event: number {event.number}, value {event.value}"
            )

        if kind == EVENT_BUTTON and not is_initial:
            self._published(now)
            return True
        if not self._is_pending:
            self.deadline = now + self._options.coalesce_interval
            self._is_pending = True
        return False

    def is_due(self, now: float) -> bool:
        """Return whether it is time to publish the state. If so, set the next deadline."""
        if self.deadline is None or now < self.deadline:
            return False
        self._published(now)
        return True

    def _published(self, now: float) -> None:
        rate = self._options.autorepeat_rate
        self._is_pending = False
        self.deadline = now + 1 / rate if rate > 0 else None

    def _set_button(self, event: Event) -> None:
        self.buttons += [0] * (event.number + 1 - len(self.buttons))
        if not self._options.sticky_buttons:
            self.buttons[event.number] = 1 if event.value else 0
        elif event.value == 1:
            self.buttons[event.number] = 1 - self.buttons[event.number]

    def _set_axis(self, event: Event, is_initial: bool) -> None:
        self.axes += [0.0] * (event.number + 1 - len(self.axes))
        # Ignore initial values by default: as in ROS, a trigger is 0 until it is moved, although its value at rest is 1.
        if is_initial and not self._options.default_trig_val:
            return
        unused = MAX_VALUE * self._options.deadzone
        value = float(event.value)
        if value > unused:
            value -= unused
        elif value < -unused:
            value += unused
        else:
            value = 0.0
        self.axes[event.number] = value * self._scale
