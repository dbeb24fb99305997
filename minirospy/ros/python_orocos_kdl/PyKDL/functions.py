"""PyKDL's functions on frames, and placeholders for kinematic chains and solvers, which are not implemented."""

from __future__ import annotations

from typing import Any, NoReturn, TypeVar, overload

from minirospy.ros.python_orocos_kdl.PyKDL.frames import Frame, Rotation
from minirospy.ros.python_orocos_kdl.PyKDL.vectors import EPSILON, Screw, Twist, Vector, Wrench, are_near

__all__ = ["Equal", "SetToZero", "addDelta", "diff", "dot", "refusal"]

_Geometry = TypeVar("_Geometry", Vector, Rotation, Frame, Twist, Wrench)


def dot(a: Vector | Twist | Wrench, b: Vector | Twist | Wrench) -> float:
    """Return the scalar product of two vectors, or the power of a twist and a wrench. Raise TypeError for other arguments."""
    if isinstance(a, Vector) and isinstance(b, Vector):
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if isinstance(a, Wrench) and isinstance(b, Twist):
        a, b = b, a
    if isinstance(a, Twist) and isinstance(b, Wrench):
        return dot(a.vel, b.force) + dot(a.rot, b.torque)
    raise TypeError("dot() takes two Vectors, or a Twist and a Wrench")


def Equal(a: object, b: object, eps: float = EPSILON) -> bool:
    """Return whether all numbers of two objects of the same type differ by less than ``eps``.

    Raise TypeError for objects of different types.
    """
    kinds = Vector | Rotation | Frame | Screw
    if type(a) is not type(b) or not isinstance(a, kinds) or not isinstance(b, kinds):
        raise TypeError("Equal() takes two objects of one type: Vector, Rotation, Frame, Twist or Wrench")
    return are_near(_numbers(a), _numbers(b), eps)


def SetToZero(a: Vector | Twist | Wrench) -> None:
    """Set all components of ``a`` to zero."""
    for index in range(3 if isinstance(a, Vector) else 6):
        a[index] = 0.0


@overload
def diff(a: Rotation, b: Rotation, dt: float = 1) -> Vector: ...
@overload
def diff(a: Frame, b: Frame, dt: float = 1) -> Twist: ...
@overload
def diff(a: Vector, b: Vector, dt: float = 1) -> Vector: ...
@overload
def diff(a: Twist, b: Twist, dt: float = 1) -> Twist: ...
@overload
def diff(a: Wrench, b: Wrench, dt: float = 1) -> Wrench: ...


def diff(a: Any, b: Any, dt: float = 1) -> Any:
    """Return the velocity that moves ``a`` to ``b`` within ``dt``. For poses, this is a twist in the base frame."""
    if isinstance(a, Frame) and isinstance(b, Frame):
        return Twist(diff(a.p, b.p, dt), diff(a.M, b.M, dt))
    if isinstance(a, Rotation) and isinstance(b, Rotation):
        return a * (a.Inverse() * b).GetRot() / dt
    return (b - a) / dt


def addDelta(a: _Geometry, da: Any, dt: float = 1) -> _Geometry:
    """Return ``a`` moved with velocity ``da`` for time ``dt``: the inverse of :func:`diff`."""
    if isinstance(a, Frame):
        return Frame(addDelta(a.M, da.rot, dt), addDelta(a.p, da.vel, dt))
    if isinstance(a, Rotation):
        turn = a.Inverse(da) * dt
        return a * Rotation.Rot(turn, turn.Norm())
    moved: _Geometry = a + da * dt
    return moved


def refusal(name: str) -> type:
    """Return a class named ``name`` in place of an unsupported one. Its constructor raises NotImplementedError with advice."""

    def refuse(*_: object, **__: object) -> NoReturn:
        raise NotImplementedError(
            f"PyKDL.{name}: minirospy has PyKDL's Vector, Rotation, Frame, Twist and Wrench, but not its kinematics. "
            "Install KDL for these, such as Debian's python3-pykdl"
        )

    return type(
        name,
        (),
        {
            "__new__": refuse,
            "_refuses": True,
            "__module__": "PyKDL",
            "__doc__": f"Refuse to be made: {name} needs KDL.",
        },
    )


def _numbers(value: Vector | Rotation | Frame | Screw) -> list[float]:
    if isinstance(value, Vector):
        return value._v
    if isinstance(value, Rotation):
        return value._m
    if isinstance(value, Frame):
        return [*value.M._m, *value.p._v]
    return [value[index] for index in range(6)]
