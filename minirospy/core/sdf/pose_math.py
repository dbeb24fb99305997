"""Poses and quaternions (x, y, z, w) as tuples of floats: compose, invert, rotate."""

from __future__ import annotations

import math

from minirospy.core.sdf.model import Pose, Quaternion, Vector

__all__ = [
    "compose",
    "inverse",
    "multiply",
    "normalized",
    "relative",
    "rotate",
    "rotate_back",
    "transform",
]


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Return the vector rotated by a unit quaternion."""
    x, y, z, w = rotation
    vx, vy, vz = vector
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def rotate_back(rotation: Quaternion, vector: Vector) -> Vector:
    """Return the vector rotated by the inverse of a unit quaternion."""
    x, y, z, w = rotation
    return rotate((-x, -y, -z, w), vector)


def multiply(left: Quaternion, right: Quaternion) -> Quaternion:
    """Return the product: the rotation ``right``, then ``left``."""
    ax, ay, az, aw = left
    bx, by, bz, bw = right
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def normalized(rotation: Quaternion) -> Quaternion:
    """Return the unit quaternion, or the identity if the length is zero or not finite."""
    length = math.sqrt(sum(each * each for each in rotation))
    if not 1e-12 < length < math.inf:
        return 0.0, 0.0, 0.0, 1.0
    x, y, z, w = rotation
    return x / length, y / length, z / length, w / length


def transform(pose: Pose, point: Vector) -> Vector:
    """Return a point of the pose's frame in the parent's frame."""
    x, y, z = rotate(pose.orientation, point)
    px, py, pz = pose.position
    return px + x, py + y, pz + z


def compose(parent: Pose, child: Pose) -> Pose:
    """Return the pose of ``child``, which is relative to ``parent``, in the frame of ``parent``'s parent."""
    return Pose(
        transform(parent, child.position), normalized(multiply(parent.orientation, child.orientation))
    )


def inverse(pose: Pose) -> Pose:
    """Return the pose of the parent in the pose's frame."""
    x, y, z, w = pose.orientation
    px, py, pz = rotate((-x, -y, -z, w), pose.position)
    return Pose((-px, -py, -pz), (-x, -y, -z, w))


def relative(base: Pose, pose: Pose) -> Pose:
    """Return ``pose`` in the frame of ``base``; both have the same parent."""
    return compose(inverse(base), pose)
