"""The classes of urdf_parser_py for joints and transmissions. Source: http://wiki.ros.org/urdf/XML/joint."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.ros.urdfdom_py.urdf_parser_py.links import Pose
from minirospy.ros.urdfdom_py.urdf_parser_py.xml_reflection.core import (
    Attribute,
    Element,
    Many,
    NamedAttribute,
    Number,
    Object,
    ObjectOf,
    Text,
    VectorOf,
)

__all__ = [
    "Actuator", "Joint", "JointCalibration", "JointDynamics", "JointLimit", "JointMimic", "PR2Transmission",
    "SafetyController", "Transmission", "TransmissionJoint",
]  # fmt: skip

_TEXT, _NUMBER, _VECTOR = Text(), Number(), VectorOf(3)
_NAME = Attribute("name", _TEXT)
_ORIGIN = Element("origin", ObjectOf(Pose), False)


class JointDynamics(Object):
    """A joint's damping and friction."""

    TAG = "dynamics"
    FIELDS = (Attribute("damping", _NUMBER, False), Attribute("friction", _NUMBER, False))

    def __init__(self, damping: float | None = None, friction: float | None = None) -> None:
        self.damping = damping
        self.friction = friction


class JointCalibration(Object):
    """The joint positions at which a reference sensor's signal changes."""

    TAG = "calibration"
    FIELDS = (Attribute("rising", _NUMBER, False, 0), Attribute("falling", _NUMBER, False, 0))

    def __init__(self, rising: float | None = None, falling: float | None = None) -> None:
        self.rising = rising
        self.falling = falling


class JointLimit(Object):
    """The limits of a joint's position, velocity and effort."""

    TAG = "limit"
    FIELDS = (
        Attribute("effort", _NUMBER),
        Attribute("lower", _NUMBER, False, 0),
        Attribute("upper", _NUMBER, False, 0),
        Attribute("velocity", _NUMBER),
    )

    def __init__(
        self,
        effort: float | None = None,
        velocity: float | None = None,
        lower: float | None = None,
        upper: float | None = None,
    ) -> None:
        self.effort = effort
        self.velocity = velocity
        self.lower = lower
        self.upper = upper


class JointMimic(Object):
    """The joint that this joint mimics."""

    TAG = "mimic"
    FIELDS = (
        Attribute("joint", _TEXT),
        Attribute("multiplier", _NUMBER, False),
        Attribute("offset", _NUMBER, False),
    )

    def __init__(
        self, joint_name: str | None = None, multiplier: float | None = None, offset: float | None = None
    ) -> None:
        self.joint = joint_name
        self.multiplier = multiplier
        self.offset = offset


class SafetyController(Object):
    """The limits that a joint's safety controller enforces."""

    TAG = "safety_controller"
    FIELDS = (
        Attribute("k_velocity", _NUMBER),
        Attribute("k_position", _NUMBER, False, 0),
        Attribute("soft_lower_limit", _NUMBER, False, 0),
        Attribute("soft_upper_limit", _NUMBER, False, 0),
    )

    def __init__(
        self,
        velocity: float | None = None,
        position: float | None = None,
        lower: float | None = None,
        upper: float | None = None,
    ) -> None:
        self.k_velocity = velocity
        self.k_position = position
        self.soft_lower_limit = lower
        self.soft_upper_limit = upper


class Joint(Object):
    """A joint between two links, given by name."""

    TYPES = ["unknown", "revolute", "continuous", "prismatic", "floating", "planar", "fixed"]
    TAG = "joint"
    FIELDS = (
        _NAME,
        Attribute("type", _TEXT),
        _ORIGIN,
        Element("axis", NamedAttribute("xyz", _VECTOR), False),
        Element("parent", NamedAttribute("link", _TEXT)),
        Element("child", NamedAttribute("link", _TEXT)),
        Element("limit", ObjectOf(JointLimit), False),
        Element("dynamics", ObjectOf(JointDynamics), False),
        Element("safety_controller", ObjectOf(SafetyController), False),
        Element("calibration", ObjectOf(JointCalibration), False),
        Element("mimic", ObjectOf(JointMimic), False),
    )

    def __init__(
        self,
        name: str | None = None,
        parent: str | None = None,
        child: str | None = None,
        joint_type: str | None = None,
        axis: Sequence[float] | None = None,
        origin: Pose | None = None,
        limit: JointLimit | None = None,
        dynamics: JointDynamics | None = None,
        safety_controller: SafetyController | None = None,
        calibration: JointCalibration | None = None,
        mimic: JointMimic | None = None,
    ) -> None:
        self.name = name
        self.parent = parent
        self.child = child
        self.type = joint_type
        self.axis = axis

        self.origin = origin
        self.limit = limit
        self.dynamics = dynamics
        self.safety_controller = safety_controller
        self.calibration = calibration
        self.mimic = mimic

    def check_valid(self) -> None:
        """Raise AssertionError if the joint's type is unknown."""
        if self.type not in self.TYPES:
            raise AssertionError(f"Invalid joint type: {self.type}")

    @property
    def joint_type(self) -> str | None:
        """Return ``type``; ``joint_type`` is its former name."""
        return self.type

    @joint_type.setter
    def joint_type(self, value: str | None) -> None:
        self.type = value


class PR2Transmission(Object):
    """A transmission in the PR2's format."""

    TAG = "pr2_transmission"
    FIELDS = (
        _NAME,
        Attribute("type", _TEXT),
        Element("joint", NamedAttribute("name", _TEXT)),
        Element("actuator", NamedAttribute("name", _TEXT)),
        Element("mechanicalReduction", _NUMBER),
    )

    def __init__(
        self,
        name: str | None = None,
        joint: str | None = None,
        actuator: str | None = None,
        type: str | None = None,
        mechanicalReduction: float = 1,
    ) -> None:
        self.name = name
        self.type = type
        self.joint = joint
        self.actuator = actuator
        self.mechanicalReduction = mechanicalReduction


class Actuator(Object):
    """An actuator in a transmission."""

    TAG = "actuator"
    FIELDS = (_NAME, Element("mechanicalReduction", _NUMBER, False))

    def __init__(self, name: str | None = None, mechanicalReduction: float | None = None) -> None:
        self.name = name
        self.mechanicalReduction = mechanicalReduction


class TransmissionJoint(Object):
    """A joint in a transmission."""

    TAG = "joint"
    FIELDS = (_NAME, Many("hardwareInterface", _TEXT))

    def __init__(self, name: str | None = None) -> None:
        self.aggregate_init()
        self.name = name
        self.hardwareInterfaces: list[str] = []

    def check_valid(self) -> None:
        """Raise AssertionError if the joint has no hardware interface."""
        if not self.hardwareInterfaces:
            raise AssertionError("no hardwareInterface defined")


class Transmission(Object):
    """A transmission. Source: http://wiki.ros.org/urdf/XML/Transmission."""

    TAG = "new_transmission"
    FIELDS = (
        _NAME,
        Element("type", _TEXT),
        Many("joint", ObjectOf(TransmissionJoint)),
        Many("actuator", ObjectOf(Actuator)),
    )

    def __init__(self, name: str | None = None) -> None:
        self.aggregate_init()
        self.name = name
        self.type: str | None = None
        self.joints: list[TransmissionJoint] = []
        self.actuators: list[Actuator] = []

    def check_valid(self) -> None:
        """Raise AssertionError if the transmission has no joint or no actuator."""
        if not self.joints:
            raise AssertionError("no joint defined")
        if not self.actuators:
            raise AssertionError("no actuator defined")
