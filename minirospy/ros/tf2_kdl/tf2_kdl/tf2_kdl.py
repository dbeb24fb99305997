"""tf2_kdl: transforms PyKDL's vectors, frames, twists and wrenches for tf2_ros. Source: http://wiki.ros.org/tf2_kdl.

Importing this module registers the types with tf2_ros. Objects to transform need a ``header``, which tf2_ros.Stamped adds.
"""

from __future__ import annotations

from typing import Any, Protocol, TypeVar

from geometry_msgs.msg import Point, PointStamped, TransformStamped
from std_msgs.msg import Header

from minirospy.ros.python_orocos_kdl import PyKDL
from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import transform_to_kdl
from minirospy.ros.tf2_ros.tf2_ros.interface import ConvertRegistration, Stamped, TransformRegistration

__all__ = [
    "PointStamped",
    "convert_vector",
    "do_transform_frame",
    "do_transform_twist",
    "do_transform_vector",
    "do_transform_wrench",
    "from_msg_vector",
    "to_msg_vector",
    "transform_to_kdl",
]

_G = TypeVar("_G", PyKDL.Vector, PyKDL.Frame, PyKDL.Twist, PyKDL.Wrench)


class _StampedVector(Protocol):
    """The type of a PyKDL.Vector returned by tf2_ros.Stamped."""

    header: Header

    def __getitem__(self, index: int) -> float: ...


def do_transform_vector(vector: PyKDL.Vector, transform: TransformStamped) -> PyKDL.Vector:
    """Return the point transformed into another frame, with the transform's header."""
    return _moved(vector, transform)


def do_transform_frame(frame: PyKDL.Frame, transform: TransformStamped) -> PyKDL.Frame:
    """Return the pose transformed into another frame, with the transform's header."""
    return _moved(frame, transform)


def do_transform_twist(twist: PyKDL.Twist, transform: TransformStamped) -> PyKDL.Twist:
    """Return the twist transformed into another frame, with the transform's header."""
    return _moved(twist, transform)


def do_transform_wrench(wrench: PyKDL.Wrench, transform: TransformStamped) -> PyKDL.Wrench:
    """Return the wrench transformed into another frame, with the transform's header."""
    return _moved(wrench, transform)


def to_msg_vector(vector: _StampedVector) -> PointStamped:
    """Convert a stamped Vector to a PointStamped."""
    return PointStamped(vector.header, Point(vector[0], vector[1], vector[2]))


def from_msg_vector(msg: PointStamped) -> PyKDL.Vector:
    """Convert a PointStamped to a stamped Vector."""
    vector = PyKDL.Vector(msg.point.x, msg.point.y, msg.point.z)
    return Stamped(vector, msg.header.stamp, msg.header.frame_id)


def convert_vector(vector: _StampedVector) -> PyKDL.Vector:
    """Return a copy of a stamped Vector."""
    copy = PyKDL.Vector(vector[0], vector[1], vector[2])
    return Stamped(copy, vector.header.stamp, vector.header.frame_id)


def _moved(value: _G, transform: TransformStamped) -> _G:
    result: Any = transform_to_kdl(transform) * value
    result.header = transform.header
    moved: _G = result
    return moved


def _register() -> None:
    transforms, conversions = TransformRegistration(), ConvertRegistration()
    transforms.add(PyKDL.Vector, do_transform_vector)
    transforms.add(PyKDL.Frame, do_transform_frame)
    transforms.add(PyKDL.Twist, do_transform_twist)
    transforms.add(PyKDL.Wrench, do_transform_wrench)
    conversions.add_to_msg(PyKDL.Vector, to_msg_vector)
    conversions.add_from_msg(PyKDL.Vector, from_msg_vector)
    conversions.add_convert((PyKDL.Vector, PyKDL.Vector), convert_vector)


_register()
