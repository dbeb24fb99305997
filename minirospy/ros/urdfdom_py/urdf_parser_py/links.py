"""The classes of urdf_parser_py for links and their parts. Source: http://wiki.ros.org/urdf/XML/link."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree as ET

from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import (
    Attribute,
    Codec,
    Element,
    Many,
    NamedAttribute,
    Number,
    Object,
    ObjectOf,
    Path,
    Text,
    VectorOf,
    report,
)

__all__ = [
    "Box", "Collision", "Color", "Cylinder", "GeometricType", "Inertia", "Inertial", "Link", "LinkMaterial",
    "Material", "Mesh", "Pose", "Sphere", "Texture", "Visual",
]  # fmt: skip

_TEXT, _NUMBER, _VECTOR = Text(), Number(), VectorOf(3)
_NAME = Attribute("name", _TEXT)
_OPTIONAL_NAME = Attribute("name", _TEXT, False)


class Pose(Object):
    """A pose: ``xyz`` in metres, ``rpy`` in radians."""

    TAG = "origin"
    FIELDS = (Attribute("xyz", _VECTOR, False, [0, 0, 0]), Attribute("rpy", _VECTOR, False, [0, 0, 0]))

    def __init__(self, xyz: Sequence[float] | None = None, rpy: Sequence[float] | None = None) -> None:
        self.xyz = xyz
        self.rpy = rpy

    def check_valid(self) -> None:
        """Raise AssertionError if a vector does not have three numbers."""
        if any(vector is not None and len(vector) != 3 for vector in (self.xyz, self.rpy)):
            raise AssertionError

    @property
    def rotation(self) -> Sequence[float] | None:
        """Return ``rpy``; ``rotation`` is its former name."""
        return self.rpy

    @rotation.setter
    def rotation(self, value: Sequence[float] | None) -> None:
        self.rpy = value

    @property
    def position(self) -> Sequence[float] | None:
        """Return ``xyz``; ``position`` is its former name."""
        return self.xyz

    @position.setter
    def position(self, value: Sequence[float] | None) -> None:
        self.xyz = value


_ORIGIN = Element("origin", ObjectOf(Pose), False)


class Color(Object):
    """A colour (red, green, blue and opacity, from 0 to 1), given as three or four numbers or as one list."""

    TAG = "color"
    FIELDS = (Attribute("rgba", VectorOf(4)),)

    def __init__(self, *args: Any) -> None:
        self.rgba: Any = args if len(args) in (3, 4) else args[0] if len(args) == 1 else None
        if self.rgba is not None:
            if len(self.rgba) == 3:
                self.rgba = [*self.rgba, 1.0]
            if len(self.rgba) != 4:
                raise Exception("Invalid color argument count")


class Box(Object):
    """A box, given by its three side lengths."""

    TAG = "box"
    FIELDS = (Attribute("size", _VECTOR),)

    def __init__(self, size: Sequence[float] | None = None) -> None:
        self.size = size


class Cylinder(Object):
    """A cylinder along the z axis."""

    TAG = "cylinder"
    FIELDS = (Attribute("radius", _NUMBER), Attribute("length", _NUMBER))

    def __init__(self, radius: float = 0.0, length: float = 0.0) -> None:
        self.radius = radius
        self.length = length


class Sphere(Object):
    """A sphere."""

    TAG = "sphere"
    FIELDS = (Attribute("radius", _NUMBER),)

    def __init__(self, radius: float = 0.0) -> None:
        self.radius = radius


class Mesh(Object):
    """A shape in a mesh file."""

    TAG = "mesh"
    FIELDS = (Attribute("filename", _TEXT), Attribute("scale", _VECTOR, False))

    def __init__(self, filename: str | None = None, scale: Sequence[float] | None = None) -> None:
        self.filename = filename
        self.scale = scale


class GeometricType(Codec[Object]):
    """A codec for the single shape in a ``<geometry>`` element."""

    _KINDS: dict[str, type[Object]] = {kind.TAG: kind for kind in (Box, Cylinder, Sphere, Mesh)}

    def from_xml(self, node: ET.Element, path: Path) -> Object:
        """Return the shape in the element. Raise AssertionError unless the element contains exactly one shape."""
        if len(node) != 1:
            raise AssertionError("One element only for geometric")
        kind = self._KINDS.get(node[0].tag)
        if kind is None:
            raise Exception(f"Invalid geometric tag: {node[0].tag}")
        return kind.from_xml(node[0], path)

    def write_xml(self, node: ET.Element, value: Object) -> None:
        """Write the shape into the element."""
        if type(value) not in self._KINDS.values():
            raise Exception(f"Invalid geometric type: {type(value)}")
        value.write_xml(ET.SubElement(node, value.TAG))


class Collision(Object):
    """A shape for collision checking."""

    TAG = "collision"
    FIELDS = (_OPTIONAL_NAME, _ORIGIN, Element("geometry", GeometricType()))

    def __init__(
        self, geometry: Object | None = None, origin: Pose | None = None, name: str | None = None
    ) -> None:
        self.geometry = geometry
        self.name = name
        self.origin = origin


class Texture(Object):
    """An image that covers a shape."""

    TAG = "texture"
    FIELDS = (Attribute("filename", _TEXT),)

    def __init__(self, filename: str | None = None) -> None:
        self.filename = filename


class Material(Object):
    """A named colour or texture."""

    TAG = "material"
    FIELDS = (_NAME, Element("color", ObjectOf(Color), False), Element("texture", ObjectOf(Texture), False))

    def __init__(
        self, name: str | None = None, color: Color | None = None, texture: Texture | None = None
    ) -> None:
        self.name = name
        self.color = color
        self.texture = texture

    def check_valid(self) -> None:
        """Report an error if the material has neither a colour nor a texture."""
        if self.color is None and self.texture is None:
            report("Material has neither a color nor texture.")


class LinkMaterial(Material):
    """A shape's material. Unlike a robot's material, it may have only a name."""

    def check_valid(self) -> None:
        """Accept a material that has only a name."""


class Visual(Object):
    """A visible shape."""

    TAG = "visual"
    FIELDS = (
        _OPTIONAL_NAME,
        _ORIGIN,
        Element("geometry", GeometricType()),
        Element("material", ObjectOf(LinkMaterial), False),
    )

    def __init__(
        self,
        geometry: Object | None = None,
        material: Material | None = None,
        origin: Pose | None = None,
        name: str | None = None,
    ) -> None:
        self.geometry = geometry
        self.material = material
        self.name = name
        self.origin = origin


class Inertia(Object):
    """Moments of inertia."""

    KEYS = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]
    TAG = "inertia"
    FIELDS = tuple(Attribute(key, _NUMBER) for key in KEYS)

    def __init__(
        self,
        ixx: float = 0.0,
        ixy: float = 0.0,
        ixz: float = 0.0,
        iyy: float = 0.0,
        iyz: float = 0.0,
        izz: float = 0.0,
    ) -> None:
        self.ixx, self.ixy, self.ixz = ixx, ixy, ixz
        self.iyy, self.iyz, self.izz = iyy, iyz, izz

    def to_matrix(self) -> list[list[float]]:
        """Return the symmetric inertia matrix."""
        return [
            [self.ixx, self.ixy, self.ixz],
            [self.ixy, self.iyy, self.iyz],
            [self.ixz, self.iyz, self.izz],
        ]


class Inertial(Object):
    """A link's mass and inertia."""

    TAG = "inertial"
    FIELDS = (
        _ORIGIN,
        Element("mass", NamedAttribute("value", _NUMBER)),
        Element("inertia", ObjectOf(Inertia), False),
    )

    def __init__(self, mass: float = 0.0, inertia: Inertia | None = None, origin: Pose | None = None) -> None:
        self.mass = mass
        self.inertia = inertia
        self.origin = origin


class Link(Object):
    """A link. ``visual`` and ``collision`` are its first visual and its first collision shape."""

    TAG = "link"
    FIELDS = (
        _NAME,
        _ORIGIN,
        Many("visual", ObjectOf(Visual)),
        Many("collision", ObjectOf(Collision)),
        Element("inertial", ObjectOf(Inertial), False),
    )

    def __init__(
        self,
        name: str | None = None,
        visual: Visual | None = None,
        inertial: Inertial | None = None,
        collision: Collision | None = None,
        origin: Pose | None = None,
    ) -> None:
        self.aggregate_init()
        self.name = name
        self.visuals: list[Visual] = []
        if visual:
            self.visual = visual
        self.inertial = inertial
        self.collisions: list[Collision] = []
        if collision:
            self.collision = collision
        self.origin = origin

    @property
    def visual(self) -> Visual | None:
        """Return the first visible shape."""
        return self.visuals[0] if self.visuals else None

    @visual.setter
    def visual(self, visual: Visual | None) -> None:
        if self.visuals:
            self.remove_aggregate(self.visuals[0])
        if visual:
            self._put_first("visual", visual)

    @property
    def collision(self) -> Collision | None:
        """Return the first shape for collision checking."""
        return self.collisions[0] if self.collisions else None

    @collision.setter
    def collision(self, collision: Collision | None) -> None:
        if self.collisions:
            self.remove_aggregate(self.collisions[0])
        if collision:
            self._put_first("collision", collision)

    def _put_first(self, name: str, shape: Object) -> None:
        self.add_aggregate(name, shape)
        shapes = self.get_aggregate_list(name)
        shapes.insert(0, shapes.pop())
