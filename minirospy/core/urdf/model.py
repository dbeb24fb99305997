"""The parts of a robot: frozen records, as http://wiki.ros.org/urdf/XML has them.

Lengths are metres, angles radians, masses kilograms; a joint's position is metres where it is prismatic.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import NamedTuple

__all__ = [
    "Box",
    "Calibration",
    "Collision",
    "Color",
    "Cylinder",
    "Dynamics",
    "Geometry",
    "Inertial",
    "Joint",
    "JointType",
    "Limit",
    "Link",
    "Material",
    "Mesh",
    "Mimic",
    "Origin",
    "Problem",
    "Robot",
    "Safety",
    "Sphere",
    "Vector",
    "Visual",
]

Vector = tuple[float, float, float]
Color = tuple[float, float, float, float]


class JointType(Enum):
    """The kind of a joint; the value is that of its ``type`` attribute."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FLOATING = "floating"
    PLANAR = "planar"
    FIXED = "fixed"


class Origin(NamedTuple):
    """A pose: ``xyz``, and ``rpy``, turns about the fixed axes x, y, z in this order."""

    xyz: Vector = (0.0, 0.0, 0.0)
    rpy: Vector = (0.0, 0.0, 0.0)


class Box(NamedTuple):
    """A box, by the lengths of its sides."""

    size: Vector


class Cylinder(NamedTuple):
    """A cylinder along z."""

    radius: float
    length: float


class Sphere(NamedTuple):
    """A ball."""

    radius: float


class Mesh(NamedTuple):
    """A file of a shape: a path or ``package://PACKAGE/PATH``."""

    filename: str
    scale: Vector = (1.0, 1.0, 1.0)


Geometry = Box | Cylinder | Sphere | Mesh


class Material(NamedTuple):
    """A colour (red, green, blue, opacity from 0 to 1) or the file of a texture, or both."""

    name: str
    color: Color | None = None
    texture: str = ""


class Visual(NamedTuple):
    """A shape to be seen. ``material``: its name where it is defined elsewhere."""

    geometry: Geometry
    origin: Origin = Origin()
    name: str = ""
    material: Material | None = None


class Collision(NamedTuple):
    """A shape to be collided with."""

    geometry: Geometry
    origin: Origin = Origin()
    name: str = ""


class Inertial(NamedTuple):
    """The mass of a link, and its inertia about its centre: ixx, ixy, ixz, iyy, iyz, izz."""

    mass: float
    inertia: tuple[float, float, float, float, float, float]
    origin: Origin = Origin()


class Limit(NamedTuple):
    """The limits of a joint's position, velocity and effort."""

    lower: float
    upper: float
    effort: float
    velocity: float


class Mimic(NamedTuple):
    """The joint's position is ``multiplier * position of joint + offset``."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


class Safety(NamedTuple):
    """Limits that a controller keeps, inside those of the joint."""

    k_velocity: float
    k_position: float = 0.0
    soft_lower: float | None = None
    soft_upper: float | None = None


class Calibration(NamedTuple):
    """Positions at which a sensor's signal changes."""

    rising: float | None
    falling: float | None


class Dynamics(NamedTuple):
    """Damping (N s/m or N m s/rad) and friction (N or N m)."""

    damping: float
    friction: float


@dataclass(frozen=True)
class Joint:
    """A joint: the frame of ``child`` is ``origin`` in that of ``parent``, then moved along or about ``axis``."""

    name: str
    type: JointType
    parent: str
    child: str
    origin: Origin
    axis: Vector
    line: int
    limit: Limit | None = None
    mimic: Mimic | None = None
    safety: Safety | None = None
    calibration: Calibration | None = None
    dynamics: Dynamics | None = None


@dataclass(frozen=True)
class Link:
    """A rigid body, and a frame."""

    name: str
    line: int
    inertial: Inertial | None = None
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[Collision, ...] = ()


class Problem(NamedTuple):
    """A fault that ROS's reader reports before it reads on; ``trail``: its lines, the cause first."""

    line: int
    trail: tuple[str, ...]
    is_warning: bool = False

    def __str__(self) -> str:
        return ": ".join(self.trail)


@dataclass(frozen=True)
class Robot:
    """A robot: its links and joints by name in the order of the file, and the link that is the root of the tree.

    ``problems``: what was left out or looks wrong, and does not keep the robot from being used.
    """

    name: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    materials: Mapping[str, Material]
    root: str
    problems: tuple[Problem, ...] = ()

    def child_joints(self, link: str) -> list[Joint]:
        """Return the joints below a link, sorted by name as ROS's tree has them."""
        return self._below.get(link, [])

    def parent_joint(self, link: str) -> Joint | None:
        """Return the joint above a link; None for the root. Of several the last by name, as in ROS."""
        return self._above.get(link)

    @cached_property
    def _sorted(self) -> list[Joint]:
        return [self.joints[name] for name in sorted(self.joints)]

    @cached_property
    def _below(self) -> dict[str, list[Joint]]:
        below: dict[str, list[Joint]] = {}
        for joint in self._sorted:
            below.setdefault(joint.parent, []).append(joint)
        return below

    @cached_property
    def _above(self) -> dict[str, Joint]:
        return {joint.child: joint for joint in self._sorted}
