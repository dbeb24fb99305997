"""Read geometries, visuals, collisions and their surfaces."""

from __future__ import annotations

from collections.abc import Callable

from minirospy.core.sdf.materials import read_material
from minirospy.core.sdf.model import (
    Box,
    Collision,
    Cylinder,
    Geometry,
    Heightmap,
    Material,
    MeshShape,
    Plane,
    Polyline,
    Pose,
    Sphere,
    Surface,
    Visual,
)
from minirospy.core.sdf.poses import unit
from minirospy.core.sdf.source import Source
from minirospy.core.sdf.text import Element

__all__ = ["read_collision", "read_geometry", "read_surface", "read_visual"]

_SURFACE = Surface()
_MIN_SIDE = 1e-4  # m; the minimum side of a box: for example, a poster on a wall may have a side of length 0
_MAX_POINTS = 10_000  # per polyline


def read_visual(element: Element, pose: Pose, source: Source) -> Visual | None:
    """Read ``<visual>``. Return None if :func:`read_geometry` returns no shape."""
    geometry = read_geometry(element, source)
    if geometry is None:
        return None
    part = element.first("material")
    material = read_material(part, source) if part is not None else Material()
    transparency = min(max(source.number(element, "transparency", 0.0), 0.0), 1.0)
    return Visual(element.attributes.get("name", ""), geometry, pose, material, transparency)


def read_collision(element: Element, pose: Pose, source: Source) -> Collision | None:
    """Read ``<collision>``. Return None if :func:`read_geometry` returns no shape."""
    geometry = read_geometry(element, source)
    if geometry is None:
        return None
    surface = read_surface(element.first("surface"), source)
    return Collision(element.attributes.get("name", ""), geometry, pose, surface)


def read_surface(element: Element | None, source: Source) -> Surface:
    """Read ``<surface>``. Without it, use ODE's defaults."""
    if element is None:
        return _SURFACE
    friction, contact = _ode(element, "friction"), _ode(element, "contact")
    return Surface(
        source.amount(friction, "mu", _SURFACE.mu, infinite=True),
        source.amount(friction, "mu2", _SURFACE.mu2, infinite=True),
        source.number(contact, "kp", _SURFACE.kp, infinite=True),
        source.number(contact, "kd", _SURFACE.kd, infinite=True),
        source.number(contact, "min_depth", _SURFACE.min_depth, infinite=True),
        source.number(contact, "max_vel", _SURFACE.max_velocity, infinite=True),
        source.number(element.first("bounce"), "restitution_coefficient", _SURFACE.restitution),
        source.vector(friction, "fdir1", _SURFACE.fdir1),
    )


def read_geometry(owner: Element, source: Source) -> Geometry | None:
    """Return a visual's or collision's shape; None for ``<empty>`` or, with a warning, if the shape is missing or unusable."""
    name = f"{owner.tag} [{owner.attributes.get('name', '')}]"
    geometry = owner.first("geometry")
    shapes = geometry.children if geometry is not None else []
    if not shapes:
        source.warn(owner, f"{name} has no geometry and is left out")
        return None
    shape = shapes[0]
    reader = _SHAPES.get(shape.tag)
    if reader is None:
        if shape.tag != "empty":
            source.warn(shape, f"{name}: the geometry <{shape.tag}> is not supported, so it is left out")
        return None
    try:
        return reader(shape, source)
    except _LeftOutError as error:
        source.warn(shape, f"{name} is left out: {error}")
        return None


class _LeftOutError(ValueError):
    """Raised if a shape is unusable but its model is not."""


def _read_box(element: Element, source: Source) -> Box:
    x, y, z = source.vector(element, "size", (1.0, 1.0, 1.0))
    if sum(side > 0.0 for side in (x, y, z)) < 2:
        raise _LeftOutError(f"the box has a size of 0 or less: {x:g} {y:g} {z:g}")
    return Box((max(x, _MIN_SIDE), max(y, _MIN_SIDE), max(z, _MIN_SIDE)))


def _read_cylinder(element: Element, source: Source) -> Cylinder:
    radius, length = _length(element, "radius", 1.0, source), _length(element, "length", 1.0, source)
    return Cylinder(radius, length)


def _read_sphere(element: Element, source: Source) -> Sphere:
    return Sphere(_length(element, "radius", 1.0, source))


def _read_plane(element: Element, source: Source) -> Plane:
    normal = unit(source.vector(element, "normal", (0.0, 0.0, 1.0)))
    if normal is None:
        raise _LeftOutError("the plane's normal is 0 0 0")
    size = element.first("size")
    if size is None or not size.text.strip():
        return Plane(normal)
    width, height = source.finite(size, (2,))
    return Plane(normal, (width, height))


def _read_mesh(element: Element, source: Source) -> MeshShape:
    submesh = element.first("submesh")
    scale = source.vector(element, "scale", (1.0, 1.0, 1.0))
    if scale.count(0.0) > 1:
        raise _LeftOutError("the mesh has a scale of 0")
    return MeshShape(
        _file(element, "uri", "mesh", source),
        scale,
        source.text(submesh, "name"),
        source.flag(submesh, "center", False),
    )


def _read_heightmap(element: Element, source: Source) -> Heightmap:
    size = source.vector(element, "size", (1.0, 1.0, 1.0))
    _require(min(size), "the heightmap has a size of 0 or less")
    path = _file(element, "uri", "heightmap's picture", source)
    return Heightmap(path, size, source.vector(element, "pos", (0.0, 0.0, 0.0)))


def _read_polyline(element: Element, source: Source) -> Polyline:
    points = []
    for point in element.all("point"):
        x, y = source.finite(point, (2,))
        points.append((x, y))
    if len(points) > 1 and points[0] == points[-1]:
        points.pop()
    if not 3 <= len(points) <= _MAX_POINTS:
        raise _LeftOutError(f"the polyline has {len(points)} points: 3 to {_MAX_POINTS} are possible")
    return Polyline(tuple(points), _length(element, "height", 1.0, source))


_SHAPES: dict[str, Callable[[Element, Source], Geometry]] = {
    "box": _read_box,
    "cylinder": _read_cylinder,
    "sphere": _read_sphere,
    "plane": _read_plane,
    "mesh": _read_mesh,
    "heightmap": _read_heightmap,
    "polyline": _read_polyline,
}


def _length(element: Element, tag: str, default: float, source: Source) -> float:
    value = source.number(element, tag, default)
    _require(value, f"the {element.tag}'s {tag} is 0 or less")
    return value


def _require(value: float, why: str) -> None:
    if value <= 0.0:
        raise _LeftOutError(f"{why}: {value:g}")


def _file(element: Element, tag: str, what: str, source: Source) -> str:
    uri = source.text(element, tag)
    if not uri:
        raise _LeftOutError(f"the {what} has no <{tag}>")
    path = source.find(uri)
    if path is None:
        raise _LeftOutError(f"the {what} {source.missing(uri)}")
    return path


def _ode(element: Element, tag: str) -> Element | None:
    part = element.first(tag)
    return part.first("ode") if part is not None else None
