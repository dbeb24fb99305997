"""Move and add inertials of links, with plain floats."""

from __future__ import annotations

from minirospy.core.sdf.model import Inertial, Pose, Quaternion, Vector
from minirospy.core.sdf.poses import compose
from minirospy.core.urdf.poses import matrix_from_quaternion

__all__ = ["Inertia", "add_inertials", "moved", "turned_inertia"]

Inertia = tuple[float, float, float, float, float, float]  # ixx, ixy, ixz, iyy, iyz, izz


def moved(inertial: Inertial, pose: Pose) -> Inertial:
    """Return a link's inertial in the frame in which the link's pose is ``pose``."""
    return inertial._replace(pose=compose(pose, inertial.pose))


def add_inertials(first: Inertial, second: Inertial) -> Inertial:
    """Return the inertial of two rigidly connected bodies, in the axes of their common frame."""
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
    """Return the rotated inertia R I R^T."""
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
