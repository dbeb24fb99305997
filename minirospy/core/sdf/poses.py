"""Arithmetic of poses and inertias with plain floats. Quaternions are (x, y, z, w) of length 1."""

from __future__ import annotations

import math

from minirospy.core.sdf.model import Inertial, Pose, Quaternion, Vector
from minirospy.core.urdf.poses import matrix_from_quaternion, quaternion_from_rpy

__all__ = [
    "Inertia",
    "add_inertials",
    "inverse",
    "moved",
    "multiply",
    "pose_from_rpy",
    "rotate",
    "turned_inertia",
    "unit",
]

Inertia = tuple[float, float, float, float, float, float]


def pose_from_rpy(xyz: Vector, rpy: Vector) -> Pose:
    """Return the pose with a rotation about the fixed axes x, y and z, in this order."""
    if not any(rpy):
        return Pose(xyz)
    return Pose(xyz, quaternion_from_rpy(*rpy))


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Return a vector, turned."""
    x, y, z, w = rotation
    vx, vy, vz = vector
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def multiply(outer: Pose, inner: Pose) -> Pose:
    """Return ``inner``, which is relative to ``outer``, in the frame of ``outer``'s parent."""
    x, y, z = rotate(outer.orientation, inner.position)
    px, py, pz = outer.position
    return Pose((px + x, py + y, pz + z), _product(outer.orientation, inner.orientation))


def inverse(pose: Pose) -> Pose:
    """Return the pose of the parent's frame in the frame of ``pose``."""
    x, y, z, w = pose.orientation
    turned = (-x, -y, -z, w)
    px, py, pz = rotate(turned, pose.position)
    return Pose((-px, -py, -pz), turned)


def unit(vector: Vector) -> Vector | None:
    """Return a vector's direction with length 1, or None if it has none."""
    length = math.sqrt(sum(value * value for value in vector))
    if not 0.0 < length < math.inf:
        return None
    x, y, z = vector
    return x / length, y / length, z / length


def moved(inertial: Inertial, pose: Pose) -> Inertial:
    """Return a link's inertial in the frame in which the link has ``pose``."""
    return inertial._replace(pose=multiply(pose, inertial.pose))


def add_inertials(first: Inertial, second: Inertial) -> Inertial:
    """Return the inertial of two bodies that are one, in the axes of their common frame."""
    mass = first.mass + second.mass
    x1, y1, z1 = first.pose.position
    x2, y2, z2 = second.pose.position
    a, b = (first.mass / mass, second.mass / mass) if mass else (1.0, 0.0)
    centre = (a * x1 + b * x2, a * y1 + b * y2, a * z1 + b * z2)
    sums = [left + right for left, right in zip(_about(first, centre), _about(second, centre), strict=True)]
    xx, xy, xz, yy, yz, zz = sums
    return Inertial(mass, Pose(centre), (xx, xy, xz, yy, yz, zz))


def _about(inertial: Inertial, centre: Vector) -> Inertia:
    """Return an inertia about a point, in the axes of the link's frame."""
    xx, xy, xz, yy, yz, zz = turned_inertia(inertial.inertia, inertial.pose.orientation)
    x, y, z = (here - there for here, there in zip(inertial.pose.position, centre, strict=True))
    mass = inertial.mass
    return (
        xx + mass * (y * y + z * z), xy - mass * x * y, xz - mass * x * z,
        yy + mass * (x * x + z * z), yz - mass * y * z, zz + mass * (x * x + y * y),
    )  # fmt: skip


def turned_inertia(inertia: Inertia, rotation: Quaternion) -> Inertia:
    """Return R I R^T."""
    if rotation[3] == 1.0:
        return inertia
    xx, xy, xz, yy, yz, zz = inertia
    rows = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    flat = matrix_from_quaternion(rotation)
    turn = (flat[0:3], flat[3:6], flat[6:9])
    half = [[sum(turn[i][k] * rows[k][j] for k in range(3)) for j in range(3)] for i in range(3)]

    def entry(i: int, j: int) -> float:
        return sum(half[i][k] * turn[j][k] for k in range(3))

    return entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)


def _product(left: Quaternion, right: Quaternion) -> Quaternion:
    ax, ay, az, aw = left
    bx, by, bz, bw = right
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
