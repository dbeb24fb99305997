"""Read the parts of a model other than shapes: inertials, sensors, plugins, lights, axes."""

from __future__ import annotations

import math
from collections.abc import Callable

from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import (
    Axis,
    Inertial,
    Light,
    Mimic,
    Plugin,
    Pose,
    Sensor,
    Vector,
)
from minirospy.core.sdf.poses import unit
from minirospy.core.sdf.source import Source
from minirospy.core.sdf.text import Element

__all__ = [
    "read_axis",
    "read_inertial",
    "read_light",
    "read_mimic",
    "read_plugin",
    "read_plugins",
    "read_sensor",
]

PoseReader = Callable[[Element], Pose]

_DIAGONAL = (0, 3, 5)
_SUFFIXES = (".so", ".dylib", ".dll")


def read_plugin(element: Element, source: Source) -> Plugin | None:
    """Read ``<plugin>``. Return None, with a warning, if it does not name a library."""
    name = element.attributes.get("name", "").strip()
    library = element.attributes.get("filename", "").strip().replace("\\", "/").rpartition("/")[2]
    for suffix in _SUFFIXES:
        library = library.removesuffix(suffix)
    library = library.removeprefix("lib")
    if not library:
        source.warn(element, f"plugin [{name}] has no filename and is left out")
        return None
    return Plugin(name, library, element)


def read_plugins(element: Element, source: Source) -> tuple[Plugin, ...]:
    """Return the plugins in an element."""
    read = (read_plugin(child, source) for child in element.all("plugin"))
    return tuple(plugin for plugin in read if plugin is not None)


def read_sensor(element: Element, pose: Pose, source: Source) -> Sensor | None:
    """Read ``<sensor>``. Return None, with a warning, if it has no type."""
    name, kind = source.name(element), element.attributes.get("type", "").strip()
    if not kind:
        source.warn(element, f"sensor [{name}] has no type and is left out")
        return None
    return Sensor(
        name,
        kind,
        element,
        pose,
        source.amount(element, "update_rate", 0.0, infinite=True),
        source.text(element, "topic"),
        read_plugins(element, source),
    )


def read_light(element: Element, pose: Pose, source: Source) -> Light:
    """Read ``<light>``."""
    kind = element.attributes.get("type", "point").strip()
    default = Light(source.name(element), kind)
    attenuation = element.first("attenuation")
    return default._replace(
        pose=pose,
        diffuse=source.color(element, "diffuse", default.diffuse) or default.diffuse,
        specular=source.color(element, "specular", default.specular) or default.specular,
        direction=unit(source.vector(element, "direction", default.direction)) or default.direction,
        range=source.number(attenuation, "range", default.range, infinite=True),
        casts_shadows=source.flag(element, "cast_shadows", default.casts_shadows),
    )


def read_inertial(link: Element, source: Source, is_static: bool, pose_of: PoseReader) -> Inertial:
    """Read a link's ``<inertial>``. If the mass is impossible, add a warning and use SDF's default."""
    element = link.first("inertial")
    if element is None:
        return Inertial()
    name = link.attributes.get("name", "")
    mass = source.number(element, "mass", 1.0, infinite=True)
    if not 0.0 < mass < math.inf:
        if not is_static:
            source.warn(
                element, f"link [{name}] has the mass {mass:g} kg, which is not possible: it gets 1 kg"
            )
        mass = 1.0

    part = element.first("inertia")
    keys = {"ixx": 1.0, "ixy": 0.0, "ixz": 0.0, "iyy": 1.0, "iyz": 0.0, "izz": 1.0}
    try:
        xx, xy, xz, yy, yz, zz = (source.number(part, key, default) for key, default in keys.items())
    except SdfError as error:
        # For example NaN, which Gazebo's building editor writes.
        source.warn(part, f"link [{name}] gets the inertia of SDF's default: {error.text}")
        xx, xy, xz, yy, yz, zz = keys.values()
    inertia = (xx, xy, xz, yy, yz, zz)
    if not is_static and min(inertia[index] for index in _DIAGONAL) <= 0.0:
        source.warn(element, f"link [{name}] has an inertia of 0 or less, which is not possible")
    return Inertial(mass, pose_of(element), inertia)


def read_axis(element: Element | None, source: Source, turned: Callable[[Element, Vector], Vector]) -> Axis:
    """Read ``<axis>`` or ``<axis2>``. ``turned`` converts the vector in ``<xyz>`` to the joint's frame."""
    if element is None:
        return Axis()
    xyz = element.first("xyz")
    direction = unit(source.vector(element, "xyz", (0.0, 0.0, 1.0)))
    if direction is None:
        source.warn(xyz, "the axis is 0 0 0: it is z instead")
        direction = (0.0, 0.0, 1.0)
    limit, dynamics = element.first("limit"), element.first("dynamics")
    lower = source.number(limit, "lower", -math.inf, infinite=True)
    upper = source.number(limit, "upper", math.inf, infinite=True)
    if lower == math.inf or upper == -math.inf:
        source.warn(
            limit, f"the limits {lower:g} and {upper:g} allow no position: the infinite one is left out"
        )
        lower, upper = (
            value if math.isfinite(value) else none for value, none in ((lower, -math.inf), (upper, math.inf))
        )
    if lower > upper:
        source.warn(limit, f"the lower limit {lower:g} is above the upper limit {upper:g}: they are switched")
        lower, upper = upper, lower
    return Axis(
        turned(element, direction),
        lower,
        upper,
        _unlimited_if_negative(source.number(limit, "effort", -1.0, infinite=True)),
        _unlimited_if_negative(source.number(limit, "velocity", -1.0, infinite=True)),
        source.amount(dynamics, "damping", 0.0),
        source.amount(dynamics, "friction", 0.0),
        source.amount(dynamics, "spring_stiffness", 0.0),
        source.number(dynamics, "spring_reference", 0.0),
        source.number(element, "initial_position", 0.0),
    )


def read_mimic(axis: Element | None, source: Source) -> Mimic | None:
    """Read an axis's ``<mimic joint="...">``, which SDF 1.11 defines and the URDF reader writes."""
    element = axis.first("mimic") if axis is not None else None
    if element is None:
        return None
    joint = element.attributes.get("joint", "").strip()
    return Mimic(joint, source.number(element, "multiplier", 1.0), source.number(element, "offset", 0.0))


def _unlimited_if_negative(value: float) -> float:
    return math.inf if value < 0.0 else value
