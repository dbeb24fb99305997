"""The turtles' world. Its inputs are commands, teleports and pens; its outputs are poses, colours and wall hits. Pure.

Lengths are in metres, angles in radians; the origin is the lower left corner. Source: http://wiki.ros.org/turtlesim, and the
behaviour of turtlesim 0.10.2.
"""

from __future__ import annotations

import math
import struct
from typing import NamedTuple

from minirospy.base.errors import MinirospyError
from minirospy.base.names import is_legal_name
from minirospy.ros.turtlesim.canvas import PIXELS, Canvas, Color

__all__ = ["BACKGROUND", "SIZE", "STEP_SECONDS", "Pen", "Pose", "Reading", "Velocity", "World", "WorldError"]

BACKGROUND = Color(69, 86, 255)  # the background if the parameters set no colour

STEP_SECONDS = 0.016  # seconds between steps

_COMMAND_SECONDS = 1.0  # seconds that a velocity command stays in effect

_PIXELS_PER_METRE = 45.0


def _float32(value: float) -> float:
    """Round a number to float32 precision."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


SIZE = _float32((PIXELS - 1) / _PIXELS_PER_METRE)
"""Width and height of the world, in metres: 11.088889."""


class WorldError(MinirospyError):
    """Raised if the world rejects a request."""


class Velocity(NamedTuple):
    """A turtle's velocity: metres per second forward and to the left, radians per second to the left."""

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0


class Pen(NamedTuple):
    """A turtle's pen; the width is in pixels."""

    color: Color = Color(179, 184, 255)
    width: int = 3


class Pose(NamedTuple):
    """A turtle's pose: metres from the left and lower walls, and the direction in radians (0: right, pi / 2: up)."""

    x: float
    y: float
    theta: float


class Reading(NamedTuple):
    """A turtle's data, which is published after each step."""

    name: str
    pose: Pose
    linear: float  # metres per second
    angular: float  # radians per second
    color: Color  # colour of the canvas under the turtle, before the turtle drew on it
    warning: str  # log line about a wall that the turtle hit, or ""


class _Teleport(NamedTuple):
    is_relative: bool
    x: float  # the x coordinate; for a relative teleport, the distance forward
    y: float
    theta: float


class _Turtle:
    """A turtle. Its ``y`` is the distance from the upper wall, as on the canvas."""

    def __init__(self, x: float, y: float, theta: float) -> None:
        self.x, self.y, self.theta = x, y, theta
        self.velocity = Velocity()
        self.command_time = -math.inf
        self.pen = Pen()
        self.is_drawing = True
        self.teleports: list[_Teleport] = []

    @property
    def pose(self) -> Pose:
        return Pose(self.x, SIZE - self.y, self.theta)

    def teleport(self, target: _Teleport) -> None:
        if target.is_relative:
            self.theta += target.theta
            self.x += math.cos(self.theta) * target.x
            self.y -= math.sin(self.theta) * target.x
        else:
            self.x, self.y, self.theta = target.x, max(0.0, SIZE - target.y), target.theta

    def move(self, seconds: float) -> None:
        """Turn the turtle, then move it, for ``seconds``."""
        forward, left, turn = self.velocity
        self.theta += turn * seconds
        # Normalise the angle to [-pi, pi).
        self.theta -= 2 * math.pi * math.floor((self.theta + math.pi) / (2 * math.pi))
        ahead, aside = math.cos(self.theta), math.sin(self.theta)
        self.x += (ahead * forward - aside * left) * seconds
        self.y -= (ahead * left + aside * forward) * seconds

    def stop_at_walls(self) -> str:
        """Clamp the position to the world. Return the warning about the wall, or "" if the turtle hit none."""
        x, y = self.x, self.y
        self.x, self.y = (min(max(value, 0.0), SIZE) for value in (x, y))
        if (x, y) == (self.x, self.y):
            return ""
        return f"Oh no! I hit the wall! (Clamping from [x={x:f}, y={y:f}])"


class World:
    """The turtles, keyed by name, and their canvas. A new world has no turtles."""

    def __init__(self, background: Color = BACKGROUND) -> None:
        self.canvas = Canvas(background)
        self._turtles: dict[str, _Turtle] = {}
        self._last_number = 0

    @property
    def names(self) -> list[str]:
        """Return the turtles' names, sorted."""
        return sorted(self._turtles)

    def pose(self, name: str) -> Pose:
        """Return a turtle's pose. Raise WorldError if the turtle does not exist."""
        return self._turtle(name).pose

    def clear(self, background: Color) -> None:
        """Clear the canvas without removing the turtles."""
        self.canvas.fill(background)

    def remove_all(self) -> None:
        """Remove all turtles, and restart the generated names at turtle1."""
        self._turtles.clear()
        self._last_number = 0

    def spawn(self, name: str, x: float, y: float, theta: float) -> str:
        """Add a turtle; return its name, which is generated if ``name`` is empty.

        Raise WorldError if the name is in use or invalid.
        """
        _check_finite(x=x, y=y, theta=theta)
        if not is_legal_name(name):
            raise WorldError(f"[{name}] is not a legal name of a turtle: letters, digits, _ and /")
        if name in self._turtles:
            raise WorldError(f"A turtled named [{name}] already exists")
        while not name or name in self._turtles:
            self._last_number += 1
            name = f"turtle{self._last_number}"
        self._turtles[name] = _Turtle(_float32(x), _float32(SIZE - y), _float32(theta))
        return name

    def spawn_first(self) -> str:
        """Add a turtle with a generated name at the centre; return its name."""
        return self.spawn("", SIZE / 2, SIZE / 2, 0.0)

    def kill(self, name: str) -> None:
        """Remove a turtle. Raise WorldError if the turtle does not exist."""
        if name not in self._turtles:
            raise WorldError(f"Tried to kill turtle [{name}], which does not exist")
        del self._turtles[name]

    def set_pen(self, name: str, color: Color, width: int, *, is_off: bool) -> None:
        """Set a turtle's pen; width 0 is drawn as one pixel. Turning a pen off does not change its colour and width."""
        turtle = self._turtle(name)
        turtle.is_drawing = not is_off
        if not is_off:
            turtle.pen = Pen(color, width or 1)

    def teleport_absolute(self, name: str, x: float, y: float, theta: float) -> None:
        """Move a turtle to a pose at the next step; its pen draws the path."""
        _check_finite(x=x, y=y, theta=theta)
        self._turtle(name).teleports.append(_Teleport(False, x, y, theta))

    def teleport_relative(self, name: str, linear: float, angular: float) -> None:
        """Turn a turtle and move it forward at the next step; its pen draws the path."""
        _check_finite(linear=linear, angular=angular)
        self._turtle(name).teleports.append(_Teleport(True, linear, 0.0, angular))

    def command(self, name: str, velocity: Velocity, now: float) -> None:
        """Set a turtle's velocity for one second after ``now`` (seconds). Raise WorldError if the velocity is not finite."""
        _check_finite(**velocity._asdict())
        turtle = self._turtle(name)
        turtle.velocity, turtle.command_time = velocity, now

    def step(self, now: float) -> list[Reading]:
        """Advance the world by 16 ms; return each turtle's data, sorted by name.

        ``now``: seconds on the clock that :meth:`command` uses.
        """
        return [self._step(name, self._turtles[name], now) for name in self.names]

    def _step(self, name: str, turtle: _Turtle, now: float) -> Reading:
        for target in turtle.teleports:
            before = turtle.x, turtle.y
            turtle.teleport(target)
            self._draw(turtle, before)
        turtle.teleports.clear()

        if now - turtle.command_time > _COMMAND_SECONDS:
            turtle.velocity = Velocity()
        before = turtle.x, turtle.y
        turtle.move(STEP_SECONDS)
        warning = turtle.stop_at_walls()
        color = self.canvas.color_at(turtle.x * _PIXELS_PER_METRE, turtle.y * _PIXELS_PER_METRE)
        if (turtle.x, turtle.y) != before:
            self._draw(turtle, before)
        forward, left, turn = turtle.velocity
        return Reading(name, turtle.pose, math.hypot(forward, left), turn, color, warning)

    def _draw(self, turtle: _Turtle, before: tuple[float, float]) -> None:
        if turtle.is_drawing:
            (x0, y0), (x1, y1) = before, (turtle.x, turtle.y)
            scale = _PIXELS_PER_METRE
            self.canvas.stroke(
                (x0 * scale, y0 * scale), (x1 * scale, y1 * scale), turtle.pen.color, turtle.pen.width
            )

    def _turtle(self, name: str) -> _Turtle:
        if name not in self._turtles:
            raise WorldError(f"There is no turtle [{name}]")
        return self._turtles[name]


def _check_finite(**numbers: float) -> None:
    for name, value in numbers.items():
        if not math.isfinite(value):
            raise WorldError(f"[{name}] is {value}: a turtle needs a finite number")
