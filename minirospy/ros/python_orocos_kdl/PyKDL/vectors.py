"""PyKDL.Vector, Twist and Wrench: three or six floats. Source: http://docs.ros.org/en/diamondback/api/kdl/html/python/."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeVar, overload

if TYPE_CHECKING:
    from std_msgs.msg import Header

__all__ = ["EPSILON", "Screw", "Twist", "Vector", "Wrench", "are_near", "numbers_text"]

EPSILON = 1e-6
_S = TypeVar("_S", bound="Screw")


class Vector:
    """Three floats: a point or a direction. Accepts additional attributes."""

    __hash__ = None  # type: ignore[assignment]
    header: Header  # only tf2_ros.Stamped sets this

    @overload
    def __init__(self, x: float, y: float, z: float) -> None: ...
    @overload
    def __init__(self, x: Vector | None = None) -> None: ...

    def __init__(
        self, x: Vector | float | None = None, y: float | None = None, z: float | None = None
    ) -> None:
        self._v: list[float]
        if isinstance(x, Vector) and y is None and z is None:
            self._v = list(x._v)
        elif x is None and y is None and z is None:
            self._v = [0.0, 0.0, 0.0]
        elif x is None or y is None or z is None or isinstance(x, Vector | str):
            raise TypeError("a Vector is made of nothing, of x, y and z, or of another Vector")
        else:
            self._v = [float(x), float(y), float(z)]

    @staticmethod
    def Zero() -> Vector:
        """Return the zero vector."""
        return Vector()

    @overload
    def x(self, value: float) -> None: ...
    @overload
    def x(self) -> float: ...

    def x(self, value: float | None = None) -> float | None:
        """Get or set the x component."""
        return self._component(0, value)

    @overload
    def y(self, value: float) -> None: ...
    @overload
    def y(self) -> float: ...

    def y(self, value: float | None = None) -> float | None:
        """Get or set the y component."""
        return self._component(1, value)

    @overload
    def z(self, value: float) -> None: ...
    @overload
    def z(self) -> float: ...

    def z(self, value: float | None = None) -> float | None:
        """Get or set the z component."""
        return self._component(2, value)

    def Norm(self, eps: float = EPSILON) -> float:
        """Return the length, or 0 if the length is below ``eps``."""
        length = math.hypot(*self._v)
        return 0.0 if length < eps else length

    def Normalize(self, eps: float = EPSILON) -> float:
        """Scale the vector to length 1 and return its previous length; a vector shorter than ``eps`` becomes (1, 0, 0)."""
        length = self.Norm(eps)
        self._v = [1.0, 0.0, 0.0] if length < eps else [each / length for each in self._v]
        return length

    def ReverseSign(self) -> None:
        """Negate the vector in place."""
        self._v = [-each for each in self._v]

    def __getitem__(self, index: int) -> float:
        if not 0 <= index < 3:
            raise IndexError("Vector index out of range")
        return self._v[index]

    def __setitem__(self, index: int, value: float) -> None:
        if not 0 <= index < 3:
            raise IndexError("Vector index out of range")
        self._v[index] = float(value)

    def __add__(self, other: Vector) -> Vector:
        if not isinstance(other, Vector):
            return NotImplemented
        a, b = self._v, other._v
        return Vector(a[0] + b[0], a[1] + b[1], a[2] + b[2])

    def __sub__(self, other: Vector) -> Vector:
        if not isinstance(other, Vector):
            return NotImplemented
        a, b = self._v, other._v
        return Vector(a[0] - b[0], a[1] - b[1], a[2] - b[2])

    def __neg__(self) -> Vector:
        return Vector(-self._v[0], -self._v[1], -self._v[2])

    @overload
    def __mul__(self, other: Vector) -> Vector: ...
    @overload
    def __mul__(self, other: float) -> Vector: ...

    def __mul__(self, other: Vector | float) -> Vector:
        """Return the cross product with a vector, or the product with a number."""
        if isinstance(other, Vector):
            (a, b, c), (x, y, z) = self._v, other._v
            return Vector(b * z - c * y, c * x - a * z, a * y - b * x)
        if not isinstance(other, int | float):
            return NotImplemented
        return Vector(self._v[0] * other, self._v[1] * other, self._v[2] * other)

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> Vector:
        if not isinstance(other, int | float):
            return NotImplemented
        # Like KDL in C++, return infinities on division by zero.
        return self * (1.0 / other if other else math.inf)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Vector) and are_near(self._v, other._v)

    def __str__(self) -> str:
        return numbers_text(self._v)

    __repr__ = __str__

    def _component(self, index: int, value: float | None) -> float | None:
        if value is None:
            return self._v[index]
        self._v[index] = float(value)
        return None


class Screw:
    """Base class of Twist and Wrench: two vectors, also indexed as six numbers."""

    _NAMES: tuple[str, str]
    __hash__ = None  # type: ignore[assignment]
    header: Header  # only tf2_ros.Stamped sets this

    def _parts(self) -> tuple[Vector, Vector]:
        first, second = (getattr(self, name) for name in self._NAMES)
        return first, second

    def _of(self: _S, first: Vector, second: Vector) -> _S:
        made = type(self).__new__(type(self))
        setattr(made, self._NAMES[0], first)
        setattr(made, self._NAMES[1], second)
        return made

    def ReverseSign(self) -> None:
        """Negate both vectors in place."""
        for part in self._parts():
            part.ReverseSign()

    def __getitem__(self, index: int) -> float:
        if not 0 <= index < 6:
            raise IndexError(f"{type(self).__name__} index out of range")
        return self._parts()[index // 3][index % 3]

    def __setitem__(self, index: int, value: float) -> None:
        if not 0 <= index < 6:
            raise IndexError(f"{type(self).__name__} index out of range")
        self._parts()[index // 3][index % 3] = value

    def __add__(self: _S, other: _S) -> _S:
        if type(other) is not type(self):
            return NotImplemented
        (a, b), (c, d) = self._parts(), other._parts()
        return self._of(a + c, b + d)

    def __sub__(self: _S, other: _S) -> _S:
        if type(other) is not type(self):
            return NotImplemented
        (a, b), (c, d) = self._parts(), other._parts()
        return self._of(a - c, b - d)

    def __neg__(self: _S) -> _S:
        first, second = self._parts()
        return self._of(-first, -second)

    def __mul__(self: _S, other: float) -> _S:
        if not isinstance(other, int | float):
            return NotImplemented
        first, second = self._parts()
        return self._of(first * other, second * other)

    __rmul__ = __mul__

    def __truediv__(self: _S, other: float) -> _S:
        if not isinstance(other, int | float):
            return NotImplemented
        first, second = self._parts()
        return self._of(first / other, second / other)

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and isinstance(other, Screw) and self._parts() == other._parts()

    def __str__(self) -> str:
        first, second = self._parts()
        return numbers_text([*first._v, *second._v])

    __repr__ = __str__


class Twist(Screw):
    """A velocity: linear ``vel`` and angular ``rot``."""

    _NAMES = ("vel", "rot")

    def __init__(self, vel: Vector | Twist | None = None, rot: Vector | None = None) -> None:
        self.vel: Vector
        self.rot: Vector
        if isinstance(vel, Twist):
            self.vel, self.rot = Vector(vel.vel), Vector(vel.rot)
        else:
            self.vel, self.rot = Vector(vel), Vector(rot)

    @staticmethod
    def Zero() -> Twist:
        """Return the zero twist."""
        return Twist()

    def RefPoint(self, base: Vector) -> Twist:
        """Return the twist of the same motion whose ``vel`` is the velocity of the point ``base``."""
        return Twist(self.vel + self.rot * base, self.rot)


class Wrench(Screw):
    """A force and a torque."""

    _NAMES = ("force", "torque")

    def __init__(self, force: Vector | Wrench | None = None, torque: Vector | None = None) -> None:
        self.force: Vector
        self.torque: Vector
        if isinstance(force, Wrench):
            self.force, self.torque = Vector(force.force), Vector(force.torque)
        else:
            self.force, self.torque = Vector(force), Vector(torque)

    @staticmethod
    def Zero() -> Wrench:
        """Return the zero wrench."""
        return Wrench()

    def RefPoint(self, base: Vector) -> Wrench:
        """Return the same load with the torque about the point ``base``."""
        return Wrench(self.force, self.torque + self.force * base)


def are_near(a: Sequence[float], b: Sequence[float], eps: float = EPSILON) -> bool:
    """Return whether all pairs of numbers differ by less than ``eps``, KDL's test for equality."""
    return all(abs(x - y) < eps for x, y in zip(a, b, strict=True))


def numbers_text(values: list[float]) -> str:
    """Format numbers like KDL, in columns of 12 characters."""
    return f"[{','.join(f'{each:12.6g}' for each in values)}]"
