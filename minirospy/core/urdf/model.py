"""A robot's parts: frozen records as described in http://wiki.ros.org/urdf/XML.

Lengths are in metres, angles in radians, masses in kilograms; a prismatic joint's position is in metres.
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
    """A joint's kind; the value is the text in its ``type`` attribute."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FLOATING = "floating"
    PLANAR = "planar"
    FIXED = "fixed"


class Origin(NamedTuple):
    """A pose: ``xyz``, and ``rpy``, rotations about the fixed axes x, y, z, in this order."""

    xyz: Vector = (0.0, 0.0, 0.0)
    rpy: Vector = (0.0, 0.0, 0.0)


class Box(NamedTuple):
    """A box, defined by its side lengths."""

    size: Vector


class Cylinder(NamedTuple):
    """A cylinder along z."""

    radius: float
    length: float


class Sphere(NamedTuple):
    """A sphere."""

    radius: float


class Mesh(NamedTuple):
    """A mesh file: a path or ``package://PACKAGE/PATH``."""

    filename: str
    scale: Vector = (1.0, 1.0, 1.0)


Geometry = Box | Cylinder | Sphere | Mesh


class Material(NamedTuple):
    """A colour (red, green, blue, opacity from 0 to 1), a texture file, or both."""

    name: str
    color: Color | None = None
    texture: str = ""


class Visual(NamedTuple):
    """A visible shape. ``material`` is just a name if the material is defined elsewhere."""

    geometry: Geometry
    origin: Origin = Origin()
    name: str = ""
    material: Material | None = None


class Collision(NamedTuple):
    """A shape for collision checks."""

    geometry: Geometry
    origin: Origin = Origin()
    name: str = ""


class Inertial(NamedTuple):
    """A link's mass, and its inertia about the centre of mass: ixx, ixy, ixz, iyy, iyz, izz."""

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
    """Makes a joint follow another: its position is ``multiplier * position of joint + offset``."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


class Safety(NamedTuple):
    """The limits for a controller, inside the joint's own limits."""

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
    """A joint: the frame of ``child`` is at ``origin`` in the frame of ``parent``, moved along or about ``axis``."""

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
    """A rigid body, which is also a frame."""

    name: str
    line: int
    inertial: Inertial | None = None
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[Collision, ...] = ()


class Problem(NamedTuple):
    """A fault that leaves the robot usable. ``trail``: the messages that ROS's parser prints, or minirospy's, the cause first."""

    line: int
    trail: tuple[str, ...]
    is_warning: bool = False

    def __str__(self) -> str:
        return ": ".join(self.trail)


@dataclass(frozen=True)
class Robot:
    """A robot: its links and joints by name in file order, and the root link of the tree.

    ``problems``: parts that were ignored or look wrong, although the robot can be used.
    """

    name: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    materials: Mapping[str, Material]
    root: str
    problems: tuple[Problem, ...] = ()

    def child_joints(self, link: str) -> list[Joint]:
        """Return the joints below a link, sorted by name as in ROS's tree."""
        return self._below.get(link, [])

    def parent_joint(self, link: str) -> Joint | None:
        """Return the joint above a link, or None for the root.

        If there are several, return the one whose name sorts last, as in ROS.
        """
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
