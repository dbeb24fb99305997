"""Records that the simulation returns. All vectors are in world axes unless stated otherwise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from minirospy.core.sdf.model import IDENTITY, Pose, Vector

__all__ = ["ZERO", "Contact", "LostModel", "RayHits", "State", "Wrench"]

ZERO: Vector = (0.0, 0.0, 0.0)


class State(NamedTuple):
    """A pose in the world, and the velocity of its origin in world axes (m/s, rad/s)."""

    pose: Pose = IDENTITY
    linear: Vector = ZERO
    angular: Vector = ZERO


class Wrench(NamedTuple):
    """A force (N) and a torque (N m)."""

    force: Vector = ZERO
    torque: Vector = ZERO


class Contact(NamedTuple):
    """The contact points of two collisions, named ``model::link::collision``.

    The normals point from the second collision to the first. The forces act on the first one, and the torques are the torques of
    these forces about the contact points.
    """

    collision1: str
    collision2: str
    positions: tuple[Vector, ...]
    normals: tuple[Vector, ...]
    depths: tuple[float, ...]
    wrenches: tuple[Wrench, ...]


class RayHits(NamedTuple):
    """Each ray's distance (m), and the name of the collision that it hits: infinity and "" if it hits nothing."""

    distances: NDArray[np.float64]
    collisions: tuple[str, ...]


class LostModel(NamedTuple):
    """A model that the simulation has removed, with the reason in one line."""

    name: str
    reason: str
