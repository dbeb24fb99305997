"""tf2_geometry_msgs: transforms points, vectors, poses and wrenches for tf2_ros.

Importing this module registers the types with tf2_ros. Source: http://wiki.ros.org/tf2_geometry_msgs.
"""

from __future__ import annotations

from typing import TypeVar

from geometry_msgs.msg import (
    Point,
    PointStamped,
    Pose,
    PoseStamped,
    Quaternion,
    TransformStamped,
    Vector3,
    Vector3Stamped,
    Wrench,
    WrenchStamped,
)

from minirospy.ros.python_orocos_kdl import PyKDL
from minirospy.ros.tf2_ros.tf2_ros.interface import ConvertRegistration, TransformRegistration

__all__ = [
    "PointStamped",
    "PoseStamped",
    "Vector3Stamped",
    "WrenchStamped",
    "do_transform_point",
    "do_transform_pose",
    "do_transform_vector3",
    "do_transform_wrench",
    "from_msg_msg",
    "to_msg_msg",
    "transform_to_kdl",
]

_M = TypeVar("_M")


def to_msg_msg(msg: _M) -> _M:
    """Return a message unchanged, because it needs no conversion."""
    return msg


def from_msg_msg(msg: _M) -> _M:
    """Return a message unchanged, because it needs no conversion."""
    return msg


def transform_to_kdl(t: TransformStamped) -> PyKDL.Frame:
    """Convert a transform to a PyKDL.Frame."""
    where, turn = t.transform.translation, t.transform.rotation
    return PyKDL.Frame(
        PyKDL.Rotation.Quaternion(turn.x, turn.y, turn.z, turn.w), PyKDL.Vector(where.x, where.y, where.z)
    )


def do_transform_point(point: PointStamped, transform: TransformStamped) -> PointStamped:
    """Return the point transformed into another frame, with the transform's header."""
    moved = transform_to_kdl(transform) * PyKDL.Vector(point.point.x, point.point.y, point.point.z)
    return PointStamped(transform.header, Point(moved[0], moved[1], moved[2]))


def do_transform_vector3(vector3: Vector3Stamped, transform: TransformStamped) -> Vector3Stamped:
    """Return the vector rotated into another frame, with the transform's header."""
    return Vector3Stamped(transform.header, _turned(vector3.vector, transform))


def do_transform_pose(pose: PoseStamped, transform: TransformStamped) -> PoseStamped:
    """Return the pose transformed into another frame, with the transform's header."""
    position, orientation = pose.pose.position, pose.pose.orientation
    frame = transform_to_kdl(transform) * PyKDL.Frame(
        PyKDL.Rotation.Quaternion(orientation.x, orientation.y, orientation.z, orientation.w),
        PyKDL.Vector(position.x, position.y, position.z),
    )
    return PoseStamped(
        transform.header,
        Pose(Point(frame.p[0], frame.p[1], frame.p[2]), Quaternion(*frame.M.GetQuaternion())),
    )


def do_transform_wrench(wrench: WrenchStamped, transform: TransformStamped) -> WrenchStamped:
    """Return the force and torque rotated into another frame, with the transform's header; their reference point is unchanged."""
    force, torque = (_turned(each, transform) for each in (wrench.wrench.force, wrench.wrench.torque))
    return WrenchStamped(transform.header, Wrench(force, torque))


def _turned(vector: Vector3, transform: TransformStamped) -> Vector3:
    turned = transform_to_kdl(transform).M * PyKDL.Vector(vector.x, vector.y, vector.z)
    return Vector3(turned[0], turned[1], turned[2])


def _register() -> None:
    transforms, conversions = TransformRegistration(), ConvertRegistration()
    transforms.add(PointStamped, do_transform_point)
    transforms.add(Vector3Stamped, do_transform_vector3)
    transforms.add(PoseStamped, do_transform_pose)
    transforms.add(WrenchStamped, do_transform_wrench)
    for kind in (Vector3Stamped, PoseStamped, PointStamped):
        conversions.add_to_msg(kind, to_msg_msg)
        conversions.add_from_msg(kind, from_msg_msg)


_register()
