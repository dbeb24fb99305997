"""Joint poses, computed with plain floats in the same steps as in urdfdom and KDL, so that even the signs of zeros are equal.

Quaternions are (x, y, z, w); a matrix is nine numbers, row by row.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from minirospy.core.urdf.model import Joint, JointType, Vector

__all__ = [
    "Pose",
    "Quaternion",
    "Segment",
    "matrix_from_quaternion",
    "quaternion_from_matrix",
    "quaternion_from_rpy",
    "rpy_from_quaternion",
]

Quaternion = tuple[float, float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]

_EPSILON = 1e-12
_POLE = 0.99999  # sine of the pitch above which roll and yaw cannot be separated


class Pose(NamedTuple):
    """A frame's pose in its parent, in metres and as a unit quaternion."""

    translation: Vector
    rotation: Quaternion


class Segment:
    """A joint and its child link. Computes the child's pose in the parent link from the joint's position.

    As in KDL, a planar joint does not move.
    """

    def __init__(self, joint: Joint) -> None:
        self.joint = joint
        self._origin = matrix_from_quaternion(quaternion_from_rpy(*joint.origin.rpy))
        self._is_turning = joint.type in (JointType.REVOLUTE, JointType.CONTINUOUS)
        self._is_sliding = joint.type is JointType.PRISMATIC
        length = math.hypot(*joint.axis)
        x, y, z = joint.axis
        # Like KDL's normalization, use the x axis if the given axis has length zero.
        self._axis = (x / length, y / length, z / length) if length >= _EPSILON else (1.0, 0.0, 0.0)

    @property
    def is_moving(self) -> bool:
        """Return whether the pose depends on the joint's position."""
        return self._is_turning or self._is_sliding

    def pose(self, position: float = 0.0) -> Pose:
        """Return the child link's pose for a position in radians or metres."""
        x, y, z = self.joint.origin.xyz
        if self._is_sliding:
            dx, dy, dz = _turned(self._origin, self._axis)
            return Pose(
                (x + position * dx, y + position * dy, z + position * dz),
                quaternion_from_matrix(self._origin),
            )
        if self._is_turning:
            return Pose(
                (x, y, z), quaternion_from_matrix(_product(self._origin, _turn(self._axis, position)))
            )
        return Pose((x, y, z), quaternion_from_matrix(self._origin))


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation about the fixed axes x, y and z, in this order."""
    sr, cr = math.sin(roll / 2), math.cos(roll / 2)
    sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
    sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    x = sr * cp * cy - cr * sp * sy
    y = cr * sp * cy + sr * cp * sy
    z = cr * cp * sy - sr * sp * cy
    w = cr * cp * cy + sr * sp * sy
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


def rpy_from_quaternion(rotation: Quaternion) -> Vector:
    """Return a rotation's roll, pitch and yaw; at a pitch of +-90 degrees the roll is 0."""
    x, y, z, w = rotation
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    sine = -2 * (x * z - w * y) / (xx + yy + zz + ww)
    if sine <= -_POLE:
        return 0.0, -math.pi / 2, 2 * math.atan2(x, -y)
    if sine >= _POLE:
        return 0.0, math.pi / 2, 2 * math.atan2(-x, y)
    return (
        math.atan2(2 * (y * z + w * x), ww - xx - yy + zz),
        math.asin(sine),
        math.atan2(2 * (x * y + w * z), ww + xx - yy - zz),
    )


def matrix_from_quaternion(rotation: Quaternion) -> Matrix:
    """Return a unit quaternion's matrix."""
    x, y, z, w = rotation
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    return (
        ww + xx - yy - zz, 2 * x * y - 2 * w * z, 2 * x * z + 2 * w * y,
        2 * x * y + 2 * w * z, ww - xx + yy - zz, 2 * y * z - 2 * w * x,
        2 * x * z - 2 * w * y, 2 * y * z + 2 * w * x, ww - xx - yy + zz,
    )  # fmt: skip


def quaternion_from_matrix(matrix: Matrix) -> Quaternion:
    """Return a matrix's unit quaternion: w is positive or, if the trace is not, the largest of the others."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = matrix
    trace = xx + yy + zz
    if trace > _EPSILON:
        s = 0.5 / math.sqrt(trace + 1)
        return (zy - yz) * s, (xz - zx) * s, (yx - xy) * s, 0.25 / s
    if xx > yy and xx > zz:
        s = 2 * math.sqrt(1 + xx - yy - zz)
        return 0.25 * s, (xy + yx) / s, (xz + zx) / s, (zy - yz) / s
    if yy > zz:
        s = 2 * math.sqrt(1 + yy - xx - zz)
        return (xy + yx) / s, 0.25 * s, (yz + zy) / s, (xz - zx) / s
    s = 2 * math.sqrt(1 + zz - xx - yy)
    return (xz + zx) / s, (yz + zy) / s, 0.25 * s, (yx - xy) / s


def _turn(axis: Vector, angle: float) -> Matrix:
    """Return the matrix for a rotation about a unit vector."""
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    v = 1 - c
    return (
        c + v * x * x, v * x * y - z * s, v * x * z + y * s,
        v * x * y + z * s, c + v * y * y, v * y * z - x * s,
        v * x * z - y * s, v * y * z + x * s, c + v * z * z,
    )  # fmt: skip


def _turned(matrix: Matrix, vector: Vector) -> Vector:
    xx, xy, xz, yx, yy, yz, zx, zy, zz = matrix
    x, y, z = vector
    return xx * x + xy * y + xz * z, yx * x + yy * y + yz * z, zx * x + zy * y + zz * z


def _product(left: Matrix, right: Matrix) -> Matrix:
    columns = [_turned(left, (right[i], right[i + 3], right[i + 6])) for i in range(3)]
    (a, d, g), (b, e, h), (c, f, i) = columns
    return a, b, c, d, e, f, g, h, i
