"""PyKDL.Rotation and PyKDL.Frame: rotation matrices and poses. Source: http://docs.ros.org/en/diamondback/api/kdl/."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeVar, overload

from minirospy.ros.python_orocos_kdl.PyKDL.vectors import EPSILON, Twist, Vector, Wrench, are_near

if TYPE_CHECKING:
    from std_msgs.msg import Header

__all__ = ["Frame", "Rotation"]

_TINY = 1e-12
_T = TypeVar("_T", Vector, Twist, Wrench)


class Rotation:
    """A 3x3 rotation matrix, stored row by row."""

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, *args: Any) -> None:
        """Create a rotation from nine numbers (row by row), three column vectors or a Rotation; default: the identity."""
        if not args:
            self._m = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        elif len(args) == 1 and isinstance(args[0], Rotation):
            self._m = list(args[0]._m)
        elif len(args) == 3 and all(isinstance(each, Vector) for each in args):
            self._m = [axis[row] for row in range(3) for axis in args]
        elif len(args) == 9:
            self._m = [float(each) for each in args]
        else:
            raise TypeError(
                "a Rotation is made of nothing, of nine numbers, of three Vectors, or of another Rotation"
            )

    # --- constructors from angles

    @staticmethod
    def Identity() -> Rotation:
        """Return the identity rotation."""
        return Rotation()

    @staticmethod
    def RotX(angle: float) -> Rotation:
        """Return a rotation about the x axis."""
        c, s = math.cos(angle), math.sin(angle)
        return Rotation(1, 0, 0, 0, c, -s, 0, s, c)

    @staticmethod
    def RotY(angle: float) -> Rotation:
        """Return a rotation about the y axis."""
        c, s = math.cos(angle), math.sin(angle)
        return Rotation(c, 0, s, 0, 1, 0, -s, 0, c)

    @staticmethod
    def RotZ(angle: float) -> Rotation:
        """Return a rotation about the z axis."""
        c, s = math.cos(angle), math.sin(angle)
        return Rotation(c, -s, 0, s, c, 0, 0, 0, 1)

    @staticmethod
    def Rot(axis: Vector, angle: float) -> Rotation:
        """Return a rotation about an axis of any length."""
        unit = Vector(axis)
        unit.Normalize()
        return Rotation.Rot2(unit, angle)

    @staticmethod
    def Rot2(axis: Vector, angle: float) -> Rotation:
        """Return a rotation about an axis of length 1."""
        x, y, z = axis._v
        c, s = math.cos(angle), math.sin(angle)
        v = 1.0 - c
        return Rotation(
            c + v * x * x, -s * z + v * x * y, s * y + v * x * z,
            s * z + v * x * y, c + v * y * y, -s * x + v * y * z,
            -s * y + v * x * z, s * x + v * y * z, c + v * z * z,
        )  # fmt: skip

    @staticmethod
    def RPY(roll: float, pitch: float, yaw: float) -> Rotation:
        """Return a rotation about the fixed axes x, then y, then z."""
        return Rotation.RotZ(yaw) * Rotation.RotY(pitch) * Rotation.RotX(roll)

    @staticmethod
    def EulerZYX(alfa: float, beta: float, gamma: float) -> Rotation:
        """Return a rotation about z, then the new y, then the new x."""
        return Rotation.RPY(gamma, beta, alfa)

    @staticmethod
    def EulerZYZ(alfa: float, beta: float, gamma: float) -> Rotation:
        """Return a rotation about z, then the new y, then the new z."""
        return Rotation.RotZ(alfa) * Rotation.RotY(beta) * Rotation.RotZ(gamma)

    @staticmethod
    def Quaternion(x: float, y: float, z: float, w: float) -> Rotation:
        """Return the rotation for a quaternion, without normalizing it."""
        xx, yy, zz, ww = x * x, y * y, z * z, w * w
        return Rotation(
            ww + xx - yy - zz, 2 * x * y - 2 * w * z, 2 * x * z + 2 * w * y,
            2 * x * y + 2 * w * z, ww - xx + yy - zz, 2 * y * z - 2 * w * x,
            2 * x * z - 2 * w * y, 2 * y * z + 2 * w * x, ww - xx - yy + zz,
        )  # fmt: skip

    # --- conversions to angles and axes

    def GetRPY(self) -> tuple[float, float, float]:
        """Return roll, pitch and yaw."""
        m = self._m
        pitch = math.atan2(-m[6], math.hypot(m[0], m[3]))
        if abs(pitch) > math.pi / 2 - _TINY:
            return 0.0, pitch, math.atan2(-m[1], m[4])
        return math.atan2(m[7], m[8]), pitch, math.atan2(m[3], m[0])

    def GetEulerZYX(self) -> tuple[float, float, float]:
        """Return the angles that :meth:`EulerZYX` accepts."""
        gamma, beta, alfa = self.GetRPY()
        return alfa, beta, gamma

    def GetEulerZYZ(self) -> tuple[float, float, float]:
        """Return the angles that :meth:`EulerZYZ` accepts."""
        m = self._m
        if abs(m[8]) > 1 - _TINY:
            return (
                (math.atan2(m[3], m[0]), 0.0, 0.0) if m[8] > 0 else (math.atan2(-m[3], -m[0]), math.pi, 0.0)
            )
        return math.atan2(m[5], m[2]), math.atan2(math.hypot(m[6], m[7]), m[8]), math.atan2(m[7], -m[6])

    def GetQuaternion(self) -> tuple[float, float, float, float]:
        """Return the quaternion x, y, z, w."""
        m = self._m
        trace = m[0] + m[4] + m[8]
        if trace > _TINY:
            s = 0.5 / math.sqrt(trace + 1.0)
            return (m[7] - m[5]) * s, (m[2] - m[6]) * s, (m[3] - m[1]) * s, 0.25 / s
        if m[0] > m[4] and m[0] > m[8]:
            s = 2.0 * math.sqrt(1.0 + m[0] - m[4] - m[8])
            return 0.25 * s, (m[1] + m[3]) / s, (m[2] + m[6]) / s, (m[7] - m[5]) / s
        if m[4] > m[8]:
            s = 2.0 * math.sqrt(1.0 + m[4] - m[0] - m[8])
            return (m[1] + m[3]) / s, 0.25 * s, (m[5] + m[7]) / s, (m[2] - m[6]) / s
        s = 2.0 * math.sqrt(1.0 + m[8] - m[0] - m[4])
        return (m[2] + m[6]) / s, (m[5] + m[7]) / s, 0.25 * s, (m[3] - m[1]) / s

    def GetRotAngle(self, eps: float = EPSILON) -> tuple[float, Vector]:
        """Return the angle and the axis, which is z if the angle is 0."""
        m = self._m
        cosine = (m[0] + m[4] + m[8] - 1) / 2.0
        tolerance = eps * eps / 2.0
        if cosine > 1 - tolerance:
            return 0.0, Vector(0, 0, 1)
        if cosine < -1 + tolerance:
            # A rotation by 180 degrees has two possible axes; like KDL, return the one with z >= 0.
            x, y, z = (math.sqrt(max(0.0, (m[each] + 1.0) / 2)) for each in (0, 4, 8))
            x = -x if m[2] < 0 else x
            y = -y if m[7] < 0 else y
            x = -x if x * y * m[1] < 0 else x
            return math.pi, Vector(x, y, z)
        axis = Vector(m[7] - m[5], m[2] - m[6], m[3] - m[1])
        length = math.hypot(*axis._v)
        return math.atan2(length / 2, cosine), axis / length

    def GetRot(self) -> Vector:
        """Return the rotation vector: the rotation axis, with the angle as its length."""
        angle, axis = self.GetRotAngle()
        return axis * angle

    def UnitX(self, value: Vector | None = None) -> Vector | None:
        """Get or set the x axis, the first column."""
        return self._column(0, value)

    def UnitY(self, value: Vector | None = None) -> Vector | None:
        """Get or set the y axis, the second column."""
        return self._column(1, value)

    def UnitZ(self, value: Vector | None = None) -> Vector | None:
        """Get or set the z axis, the third column."""
        return self._column(2, value)

    # --- modification and inversion

    def DoRotX(self, angle: float) -> None:
        """Rotate about the local x axis."""
        self._m = (self * Rotation.RotX(angle))._m

    def DoRotY(self, angle: float) -> None:
        """Rotate about the local y axis."""
        self._m = (self * Rotation.RotY(angle))._m

    def DoRotZ(self, angle: float) -> None:
        """Rotate about the local z axis."""
        self._m = (self * Rotation.RotZ(angle))._m

    def SetInverse(self) -> None:
        """Invert the rotation in place."""
        self._m = self.Inverse()._m

    @overload
    def Inverse(self, arg: None = None) -> Rotation: ...
    @overload
    def Inverse(self, arg: _T) -> _T: ...

    def Inverse(self, arg: Vector | Twist | Wrench | None = None) -> object:
        """Return the inverse. If ``arg`` is a vector, twist or wrench, return it rotated by the inverse instead."""
        m = self._m
        inverse = Rotation(m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8])
        return inverse if arg is None else inverse * arg

    @overload
    def __mul__(self, other: Rotation) -> Rotation: ...
    @overload
    def __mul__(self, other: _T) -> _T: ...

    def __mul__(self, other: object) -> object:
        m = self._m
        if isinstance(other, Vector):
            x, y, z = other._v
            return Vector(
                m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z
            )

        if isinstance(other, Rotation):
            n = other._m
            return Rotation(
                *(
                    m[r] * n[c] + m[r + 1] * n[c + 3] + m[r + 2] * n[c + 6]
                    for r in (0, 3, 6)
                    for c in range(3)
                )
            )
        if isinstance(other, Twist):
            return Twist(self * other.vel, self * other.rot)
        if isinstance(other, Wrench):
            return Wrench(self * other.force, self * other.torque)
        return NotImplemented

    def __getitem__(self, index: tuple[int, int]) -> float:
        row, column = index
        if not (0 <= row < 3 and 0 <= column < 3):
            raise IndexError("Rotation index out of range")
        return self._m[3 * row + column]

    def __setitem__(self, index: tuple[int, int], value: float) -> None:
        row, column = index
        if not (0 <= row < 3 and 0 <= column < 3):
            raise IndexError("Rotation index out of range")
        self._m[3 * row + column] = float(value)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Rotation) and are_near(self._m, other._m)

    def __str__(self) -> str:
        rows = (",".join(f"{each:12.6g}" for each in self._m[start : start + 3]) for start in (0, 3, 6))
        return "[" + ";\n ".join(rows) + "]"

    __repr__ = __str__

    def _column(self, index: int, value: Vector | None) -> Vector | None:
        if value is None:
            return Vector(self._m[index], self._m[index + 3], self._m[index + 6])
        self._m[index::3] = value._v
        return None


class Frame:
    """A pose: the rotation ``M`` and the position ``p``."""

    __hash__ = None  # type: ignore[assignment]
    header: Header  # only tf2_ros.Stamped sets this

    def __init__(self, R: Rotation | Vector | Frame | None = None, V: Vector | None = None) -> None:
        """Create a pose from a Rotation, a Vector or both, or from another Frame; default: the identity."""
        self.M: Rotation
        self.p: Vector
        if isinstance(R, Frame):
            self.M, self.p = Rotation(R.M), Vector(R.p)
        elif isinstance(R, Vector) and V is None:
            self.M, self.p = Rotation(), Vector(R)
        elif R is None or isinstance(R, Rotation):
            self.M, self.p = Rotation(R) if R is not None else Rotation(), Vector(V)
        else:
            raise TypeError(
                "a Frame is made of a Rotation and a Vector, of one of them, of a Frame, or of nothing"
            )

    @staticmethod
    def Identity() -> Frame:
        """Return the identity pose."""
        return Frame()

    @staticmethod
    def DH(a: float, alpha: float, d: float, theta: float) -> Frame:
        """Return the pose for Denavit-Hartenberg parameters."""
        ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
        return Frame(
            Rotation(ct, -st * ca, st * sa, st, ct * ca, -ct * sa, 0, sa, ca), Vector(a * ct, a * st, d)
        )

    @staticmethod
    def DH_Craig1989(a: float, alpha: float, d: float, theta: float) -> Frame:
        """Return the pose for modified Denavit-Hartenberg parameters, as defined by Craig (1989)."""
        ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
        return Frame(
            Rotation(ct, -st, 0, st * ca, ct * ca, -sa, st * sa, ct * sa, ca), Vector(a, -sa * d, ca * d)
        )

    def Integrate(self, twist: Twist, frequency: float) -> None:
        """Move the frame by a twist, expressed in this frame, for ``1 / frequency`` seconds."""
        angle = twist.rot.Norm() / frequency
        if angle < EPSILON:
            self.p = self.p + self.M * (twist.vel / frequency)
            return
        moved = self * Frame(Rotation.Rot(twist.rot, angle), twist.vel / frequency)
        self.M, self.p = moved.M, moved.p

    @overload
    def Inverse(self, arg: None = None) -> Frame: ...
    @overload
    def Inverse(self, arg: _T) -> _T: ...

    def Inverse(self, arg: object = None) -> object:
        """Return the inverse. If ``arg`` is a point, twist or wrench, return it transformed by the inverse instead."""
        back = self.M.Inverse()
        if arg is None:
            return Frame(back, -(back * self.p))
        if isinstance(arg, Vector):
            return back * (arg - self.p)
        if isinstance(arg, Twist):
            return Twist(back * (arg.vel - self.p * arg.rot), back * arg.rot)
        if isinstance(arg, Wrench):
            return Wrench(back * arg.force, back * (arg.torque - self.p * arg.force))
        raise TypeError("the inverse of a Frame applies to a Vector, a Twist or a Wrench")

    @overload
    def __mul__(self, other: Frame) -> Frame: ...
    @overload
    def __mul__(self, other: _T) -> _T: ...

    def __mul__(self, other: object) -> object:
        if isinstance(other, Vector):
            return self.M * other + self.p
        if isinstance(other, Frame):
            return Frame(self.M * other.M, self.M * other.p + self.p)
        if isinstance(other, Twist):
            turned = self.M * other.rot
            return Twist(self.M * other.vel + self.p * turned, turned)
        if isinstance(other, Wrench):
            force = self.M * other.force
            return Wrench(force, self.M * other.torque + self.p * force)
        return NotImplemented

    def __getitem__(self, index: tuple[int, int]) -> float:
        row, column = index
        if not (0 <= row < 3 and 0 <= column < 4):
            raise IndexError("Frame index out of range")
        return self.p[row] if column == 3 else self.M[row, column]

    def __setitem__(self, index: tuple[int, int], value: float) -> None:
        row, column = index
        if not (0 <= row < 3 and 0 <= column < 4):
            raise IndexError("Frame index out of range")
        if column == 3:
            self.p[row] = value
        else:
            self.M[row, column] = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Frame) and self.M == other.M and self.p == other.p

    def __str__(self) -> str:
        return f"[{self.M}\n{self.p}]"

    __repr__ = __str__
