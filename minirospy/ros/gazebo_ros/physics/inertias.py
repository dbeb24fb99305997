"""Inertias that MuJoCo accepts: their principal moments are positive and satisfy the triangle inequality."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from minirospy.core.sdf.model import Inertial, Pose, Quaternion, Vector
from minirospy.core.sdf.poses import multiply
from minirospy.core.urdf.poses import quaternion_from_matrix

__all__ = ["PrincipalInertia", "principal_inertia"]

MIN_MASS = 1e-6  # kg; MuJoCo rejects moving bodies without mass
MIN_MOMENT = 1e-10  # kg m^2


class PrincipalInertia(NamedTuple):
    """A mass, the pose of the principal axes in the link, and the moments about them."""

    mass: float
    pose: Pose
    moments: Vector


def principal_inertia(inertial: Inertial) -> PrincipalInertia:
    """Return the principal inertia of a link, corrected if it is invalid."""
    mass = max(inertial.mass, MIN_MASS)
    xx, xy, xz, yy, yz, zz = inertial.inertia
    if not (xy or xz or yz):
        return PrincipalInertia(mass, inertial.pose, _valid((xx, yy, zz)))

    moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    flat = [float(value) for value in axes.ravel()]
    turn: Quaternion = quaternion_from_matrix(tuple(flat))  # type: ignore[arg-type]
    pose = Pose(inertial.pose.position, multiply(inertial.pose.orientation, turn))
    a, b, c = (float(value) for value in moments)
    return PrincipalInertia(mass, pose, _valid((a, b, c)))


def _valid(moments: Vector) -> Vector:
    """Increase the moments until each is positive and at most the sum of the other two."""
    a, b, c = (max(value, MIN_MOMENT) for value in moments)
    lacking = max(a - b - c, b - a - c, c - a - b, 0.0)
    return a + lacking, b + lacking, c + lacking
