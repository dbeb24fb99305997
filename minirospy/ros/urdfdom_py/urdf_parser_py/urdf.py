"""urdf_parser_py's class for a robot, with all of its parts. Source: http://wiki.ros.org/urdf/XML."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as ET

from minirospy.ros.urdfdom_py.urdf_parser_py.joints import (
    Actuator,
    Joint,
    JointCalibration,
    JointDynamics,
    JointLimit,
    JointMimic,
    PR2Transmission,
    SafetyController,
    Transmission,
    TransmissionJoint,
)
from minirospy.ros.urdfdom_py.urdf_parser_py.links import (
    Box,
    Collision,
    Color,
    Cylinder,
    GeometricType,
    Inertia,
    Inertial,
    Link,
    LinkMaterial,
    Material,
    Mesh,
    Pose,
    Sphere,
    Texture,
    Visual,
)
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection import core as xmlr
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import (
    Attribute,
    Codec,
    Many,
    Object,
    ObjectOf,
    ParseError,
    Path,
    Raw,
    Text,
)

__all__ = [
    "URDF", "Actuator", "Box", "Collision", "Color", "Cylinder", "GeometricType", "Inertia", "Inertial", "Joint",
    "JointCalibration", "JointDynamics", "JointLimit", "JointMimic", "Link", "LinkMaterial", "Material", "Mesh",
    "PR2Transmission", "Pose", "Robot", "SafetyController", "Sphere", "Texture", "Transmission", "TransmissionJoint",
    "Visual", "verbose", "xmlr",
]  # fmt: skip

verbose = True
_TEXT = Text()
_NAME = Attribute("name", _TEXT)


class _Transmissions(Codec[Object]):
    """A codec for a transmission in either of its two formats."""

    def from_xml(self, node: ET.Element, path: Path) -> Object:
        for kind in (Transmission, PR2Transmission):
            try:
                return kind.from_xml(node, Path(path.tag, path.parent, path.suffix))
            except Exception as error:  # noqa: BLE001 - whatever the first form does not allow
                if kind is Transmission:
                    first = error
        name = f"urdf_parser_py.urdf.{Transmission.__name__}"
        why = f"Could not perform duck-typed parsing.\nValue Type: <class '{name}'>\nException: {first}\n"
        if "name" in node.attrib:
            path.suffix = f"[@name='{node.attrib['name']}']"
        raise ParseError(Exception(why), path)

    def write_xml(self, node: ET.Element, value: Object) -> None:
        value.write_xml(node)


class Robot(Object):
    """A robot. Its parts are available in lists and, keyed by name, in ``joint_map`` and ``link_map``.

    ``parent_map`` maps a link to (joint, parent link), ``child_map`` a link to [(joint, child link), ...].
    """

    SUPPORTED_VERSIONS = ["1.0"]
    TAG = "robot"
    FIELDS = (
        _NAME,
        Attribute("version", _TEXT, False),
        Many("link", ObjectOf(Link)),
        Many("joint", ObjectOf(Joint)),
        Many("gazebo", Raw()),
        Many("transmission", _Transmissions()),
        Many("material", ObjectOf(Material)),
    )

    def __init__(self, name: str | None = None, version: str | None = "1.0") -> None:
        self.aggregate_init()
        self.name = name
        self.version = version
        self._check_version()
        self.joints: list[Joint] = []
        self.links: list[Link] = []
        self.materials: list[Material] = []
        self.gazebos: list[ET.Element] = []
        self.transmissions: list[Transmission | PR2Transmission] = []
        self.joint_map: dict[str, Joint] = {}
        self.link_map: dict[str, Link] = {}
        self.parent_map: dict[str, tuple[str, str]] = {}
        self.child_map: dict[str, list[tuple[str, str]]] = {}

    @classmethod
    def from_parameter_server(cls, key: str = "robot_description") -> Robot:
        """Build the robot from the description stored in a parameter.

        Raise KeyError if the parameter is not set, and the exceptions of from_xml_string if the description is invalid.
        """
        from minirospy import client as rospy

        return cls.from_xml_string(rospy.get_param(key))

    def add_aggregate(self, xml_var: str, obj: Any) -> None:
        """Add a part to the robot under the tag ``xml_var``."""
        super().add_aggregate(xml_var, obj)
        if xml_var == "joint":
            self.joint_map[obj.name] = obj
            self.parent_map[obj.child] = (obj.name, obj.parent)
            self.child_map.setdefault(obj.parent, []).append((obj.name, obj.child))
        elif xml_var == "link":
            self.link_map[obj.name] = obj

    def add_link(self, link: Link) -> None:
        """Add a link."""
        self.add_aggregate("link", link)

    def add_joint(self, joint: Joint) -> None:
        """Add a joint."""
        self.add_aggregate("joint", joint)

    def get_chain(
        self, root: str, tip: str, joints: bool = True, links: bool = True, fixed: bool = True
    ) -> list[str]:
        """Return the names on the path from link ``root`` to link ``tip``: joints (optionally ``fixed`` ones), links, or both.

        Raise KeyError if ``tip`` is not below ``root``.
        """
        chain = [tip] if links else []
        link, seen = tip, {tip}
        while link != root:
            joint, link = self.parent_map[link]
            if link in seen:
                raise KeyError(root)
            seen.add(link)
            if joints and (fixed or self.joint_map[joint].type != "fixed"):
                chain.append(joint)
            if links:
                chain.append(link)
        return chain[::-1]

    def get_root(self) -> str:
        """Return the only link without a parent. Raise AssertionError unless there is exactly one such link."""
        roots = [name for name in self.link_map if name not in self.parent_map]
        if len(roots) > 1:
            raise AssertionError("Multiple roots detected, invalid URDF.")
        if not roots:
            raise AssertionError("No roots detected, invalid URDF.")
        return roots[0]

    def post_read_xml(self) -> None:
        """Raise ValueError if the description's version is not supported."""
        if self.version is None:
            self.version = "1.0"
        numbers = self.version.split(".")
        if len(numbers) != 2:
            raise ValueError("The version attribute should be in the form 'x.y'")
        if "" in numbers:
            raise ValueError("Empty major or minor number is not allowed")
        if any(int(number) < 0 for number in numbers):
            raise ValueError("Version number must be positive")
        self._check_version()

    def _check_version(self) -> None:
        if self.version not in self.SUPPORTED_VERSIONS:
            raise ValueError(f"Invalid version; only {','.join(self.SUPPORTED_VERSIONS)} is supported")


URDF = Robot
