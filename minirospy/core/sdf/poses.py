"""Arithmetic with poses, vectors and unit quaternions (x, y, z, w), in plain floats."""

from __future__ import annotations

import math

from minirospy.core.sdf.model import Pose, Quaternion, Vector
from minirospy.core.tf2.rotation import multiply, rotate
from minirospy.core.urdf.poses import quaternion_from_rpy

__all__ = [
    "add",
    "compose",
    "cross",
    "difference",
    "inverse",
    "multiply",
    "normalized",
    "pose_from_rpy",
    "relative",
    "rotate",
    "rotate_back",
    "transform",
    "unit",
]


def pose_from_rpy(xyz: Vector, rpy: Vector) -> Pose:
    """Return the pose with rotations about the fixed axes x, y and z, in this order."""
    if not any(rpy):
        return Pose(xyz)
    return Pose(xyz, quaternion_from_rpy(*rpy))


def rotate_back(rotation: Quaternion, vector: Vector) -> Vector:
    """Return the vector rotated by the inverse of a rotation."""
    x, y, z, w = rotation
    return rotate((-x, -y, -z, w), vector)


def normalized(rotation: Quaternion) -> Quaternion:
    """Return the normalized quaternion, or the identity if the length is zero or not finite."""
    length = math.sqrt(sum(each * each for each in rotation))
    if not 1e-12 < length < math.inf:
        return 0.0, 0.0, 0.0, 1.0
    x, y, z, w = rotation
    return x / length, y / length, z / length, w / length


def add(left: Vector, right: Vector) -> Vector:
    """Return the sum of two vectors."""
    return left[0] + right[0], left[1] + right[1], left[2] + right[2]


def difference(left: Vector, right: Vector) -> Vector:
    """Return ``left - right``."""
    return left[0] - right[0], left[1] - right[1], left[2] - right[2]


def cross(left: Vector, right: Vector) -> Vector:
    """Return the cross product of two vectors."""
    ax, ay, az = left
    bx, by, bz = right
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def unit(vector: Vector) -> Vector | None:
    """Return the unit vector in a vector's direction, or None if it has no direction."""
    length = math.sqrt(sum(value * value for value in vector))
    if not 0.0 < length < math.inf:
        return None
    x, y, z = vector
    return x / length, y / length, z / length


def transform(pose: Pose, point: Vector) -> Vector:
    """Convert a point from the pose's frame to the parent's frame."""
    x, y, z = rotate(pose.orientation, point)
    px, py, pz = pose.position
    return px + x, py + y, pz + z


def compose(parent: Pose, child: Pose) -> Pose:
    """Convert the pose ``child`` from the frame at ``parent`` to the frame in which ``parent`` is given."""
    return Pose(
        transform(parent, child.position), normalized(multiply(parent.orientation, child.orientation))
    )


def inverse(pose: Pose) -> Pose:
    """Return the pose of the parent in the pose's frame."""
    x, y, z, w = pose.orientation
    turned = (-x, -y, -z, w)
    px, py, pz = rotate(turned, pose.position)
    return Pose((-px, -py, -pz), turned)


def relative(base: Pose, pose: Pose) -> Pose:
    """Convert ``pose`` to the frame at ``base``; both are given in the same frame."""
    return compose(inverse(base), pose)
