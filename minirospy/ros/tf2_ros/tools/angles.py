"""Converts quaternions to angles in the same way as ROS's two programs, so that zeros have the same signs."""

from __future__ import annotations

import math

from minirospy.core.tf2.rotation import Quaternion, Vector

__all__ = ["euler_of_matrix", "rpy_of_matrix"]

_SMALL = 4 * 2.0**-52


def rpy_of_matrix(rotation: Quaternion) -> Vector:
    """Return roll, pitch and yaw, computed like tf_echo's output: the yaw is 0 if the pitch is +/-90 degrees."""
    (xx, xy, xz), (yx, _, _), (zx, zy, zz) = _matrix(rotation)
    if zx <= -1:
        return math.atan2(xy, xz), math.pi / 2, 0.0
    if zx >= 1:
        return math.atan2(-xy, -xz), -math.pi / 2, 0.0
    pitch = -math.asin(zx)
    c = math.cos(pitch)
    return math.atan2(zy / c, zz / c), pitch, math.atan2(yx / c, xx / c)


def euler_of_matrix(rotation: Quaternion) -> Vector:
    """Return roll, pitch and yaw, computed in the same way as in tf2_tools' echo.py."""
    (xx, _, _), (yx, yy, yz), (zx, zy, zz) = _matrix(rotation)
    cosine = math.sqrt(xx * xx + yx * yx)
    if cosine > _SMALL:
        return math.atan2(zy, zz), math.atan2(-zx, cosine), math.atan2(yx, xx)
    return math.atan2(-yz, yy), math.atan2(-zx, cosine), 0.0


def _matrix(rotation: Quaternion) -> tuple[Vector, Vector, Vector]:
    x, y, z, w = rotation
    s = 2.0 / (x * x + y * y + z * z + w * w)
    xs, ys, zs = x * s, y * s, z * s
    wx, wy, wz = w * xs, w * ys, w * zs
    xx, xy, xz = x * xs, x * ys, x * zs
    yy, yz, zz = y * ys, y * zs, z * zs
    return (
        (1.0 - (yy + zz), xy - wz, xz + wy),
        (xy + wz, 1.0 - (xx + zz), yz - wx),
        (xz - wy, yz + wx, 1.0 - (xx + yy)),
    )
