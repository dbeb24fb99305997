"""Read ``<link>``, ``<material>`` and their contents from elements."""

from __future__ import annotations

from collections.abc import Callable

from minirospy.core.urdf.elements import Element
from minirospy.core.urdf.model import (
    Box,
    Collision,
    Color,
    Cylinder,
    Geometry,
    Inertial,
    Link,
    Material,
    Mesh,
    Origin,
    Problem,
    Sphere,
    Vector,
    Visual,
)
from minirospy.core.urdf.values import NotANumberError, as_float, parse_numbers, parse_vector

__all__ = ["ElementError", "read_link", "read_material", "read_origin"]

_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


class ElementError(ValueError):
    """An element is invalid. Contains its line, and the messages that ROS prints about it, the cause first."""

    def __init__(self, line: int, *trail: str) -> None:
        super().__init__(line, *trail)
        self.line = line
        self.trail = trail


def read_link(element: Element, problems: list[Problem]) -> Link:
    """Parse a ``<link>`` element.

    Its invalid parts are left out, and added to ``problems``. Raise ElementError if the link is unusable.
    """
    name = element.attributes.get("name")
    if name is None:
        raise ElementError(element.line, "No name given for the link.")

    inertial, visuals, collisions = None, [], []
    for part in element.children:
        try:
            if part.tag == "inertial" and inertial is None:
                inertial = _read_inertial(part)
            elif part.tag == "visual":
                visuals.append(_read_visual(part, problems))
            elif part.tag == "collision":
                geometry = _read_geometry(part)
                collisions.append(Collision(geometry, read_origin(part), part.attributes.get("name", "")))
        except ElementError as error:
            what = f"Could not parse {part.tag} element for Link [{name}]"
            problems.append(Problem(error.line, (*error.trail, what)))
    return Link(name, element.line, inertial, tuple(visuals), tuple(collisions))


def read_material(element: Element, problems: list[Problem]) -> Material:
    """Parse a ``<material>`` element.

    A reference by name has neither colour nor texture. Raise ElementError if it has no name.
    """
    name = element.attributes.get("name")
    if name is None:
        raise ElementError(element.line, "Material must contain a name attribute")
    texture = element.first("texture")
    return Material(
        name, _read_color(element, name, problems), texture.attributes.get("filename", "") if texture else ""
    )


def read_origin(element: Element) -> Origin:
    """Return the ``<origin>`` in an element. Raise ElementError if it is invalid."""
    origin = element.first("origin")
    if origin is None:
        return Origin()
    return Origin(_vector(origin, "xyz", (0.0, 0.0, 0.0)), _vector(origin, "rpy", (0.0, 0.0, 0.0)))


def _read_color(element: Element, name: str, problems: list[Problem]) -> Color | None:
    color = element.first("color")
    if color is None or "rgba" not in color.attributes:
        return None
    try:
        numbers = parse_numbers(color.attributes["rgba"], "color")
        if len(numbers) != 4:
            raise NotANumberError(f"{len(numbers)} numbers instead of 4")
    except NotANumberError as error:
        why = f"Material [{name}] has malformed color rgba values: {error}"
        problems.append(Problem(color.line, (why,)))
        return None
    red, green, blue, alpha = numbers
    return red, green, blue, alpha


def _read_visual(element: Element, problems: list[Problem]) -> Visual:
    origin, geometry, material = read_origin(element), _read_geometry(element), element.first("material")
    if material is not None and "name" not in material.attributes:
        raise ElementError(material.line, "Visual material must contain a name attribute")
    looks = None if material is None else read_material(material, problems)
    return Visual(geometry, origin, element.attributes.get("name", ""), looks)


def _read_inertial(element: Element) -> Inertial:
    origin = read_origin(element)
    mass, inertia = element.first("mass"), element.first("inertia")
    if mass is None:
        raise ElementError(element.line, "Inertial element must have a mass element")
    if "value" not in mass.attributes:
        raise ElementError(mass.line, "Inertial: mass element must have value attribute")
    weight = _number(mass, "value", "Inertial: mass [{}] is not a float")
    if inertia is None:
        raise ElementError(element.line, "Inertial element must have inertia element")
    for key in _INERTIA:
        if key not in inertia.attributes:
            raise ElementError(inertia.line, f"Inertial: inertia element missing {key} attribute")
    xx, xy, xz, yy, yz, zz = (
        _number(inertia, key, f"Inertial: inertia element {key} is not a valid double") for key in _INERTIA
    )
    return Inertial(weight, (xx, xy, xz, yy, yz, zz), origin)


def _read_geometry(element: Element) -> Geometry:
    geometry = element.first("geometry")
    if geometry is None:
        raise ElementError(element.line)
    if not geometry.children:
        raise ElementError(geometry.line, "Geometry tag contains no child element.")
    shape = geometry.children[0]
    reader = _SHAPES.get(shape.tag)
    if reader is None:
        raise ElementError(shape.line, f"Unknown geometry type '{shape.tag}'")
    return reader(shape)


def _read_box(element: Element) -> Box:
    if "size" not in element.attributes:
        raise ElementError(element.line, "Box shape has no size attribute")
    return Box(_vector(element, "size", (0.0, 0.0, 0.0)))


def _read_cylinder(element: Element) -> Cylinder:
    if not {"length", "radius"} <= element.attributes.keys():
        raise ElementError(element.line, "Cylinder shape must have both length and radius attributes")
    length = _number(element, "length", "length [{}] is not a valid float")
    return Cylinder(_number(element, "radius", "radius [{}] is not a valid float"), length)


def _read_sphere(element: Element) -> Sphere:
    if "radius" not in element.attributes:
        raise ElementError(element.line, "Sphere shape must have a radius attribute")
    return Sphere(_number(element, "radius", "radius [{}] is not a valid float"))


def _read_mesh(element: Element) -> Mesh:
    if "filename" not in element.attributes:
        raise ElementError(element.line, "Mesh must contain a filename attribute")
    if "scale" not in element.attributes:
        return Mesh(element.attributes["filename"])
    try:
        return Mesh(element.attributes["filename"], parse_vector(element.attributes["scale"]))
    except NotANumberError as error:
        why = f"Mesh scale was specified, but could not be parsed: {error}"
        raise ElementError(element.line, why) from None


_SHAPES: dict[str, Callable[[Element], Geometry]] = {
    "box": _read_box,
    "cylinder": _read_cylinder,
    "sphere": _read_sphere,
    "mesh": _read_mesh,
}


def _vector(element: Element, name: str, default: Vector) -> Vector:
    text = element.attributes.get(name)
    if text is None:
        return default
    try:
        return parse_vector(text)
    except NotANumberError as error:
        raise ElementError(element.line, str(error)) from None


def _number(element: Element, name: str, why: str) -> float:
    try:
        return as_float(element.attributes[name])
    except NotANumberError:
        raise ElementError(element.line, why.format(element.attributes[name])) from None
