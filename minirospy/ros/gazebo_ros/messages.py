"""Convert between the simulation's records and ROS messages."""

from __future__ import annotations

import math

from geometry_msgs.msg import Pose as PoseMsg
from geometry_msgs.msg import Quaternion as QuaternionMsg
from geometry_msgs.msg import Twist, Vector3
from geometry_msgs.msg import Vector3 as VectorMsg

from minirospy.base.times import Duration, Time
from minirospy.core.sdf.model import Pose, Quaternion, Vector

__all__ = [
    "duration_seconds",
    "pose_of",
    "quaternion_of",
    "time_of",
    "to_pose",
    "to_twist",
    "to_vector",
    "vector_of",
    "yaw_of",
]

_BILLION = 1_000_000_000


def to_pose(pose: Pose) -> PoseMsg:
    """Return a pose as a message."""
    message = PoseMsg()
    message.position.x, message.position.y, message.position.z = pose.position
    message.orientation = QuaternionMsg(*pose.orientation)
    return message


def to_vector(vector: Vector) -> VectorMsg:
    """Return a vector as a message."""
    return Vector3(*vector)


def to_twist(linear: Vector, angular: Vector) -> Twist:
    """Return velocities as a message."""
    return Twist(Vector3(*linear), Vector3(*angular))


def vector_of(message: object) -> Vector:
    """Return the x, y and z of a Vector3 or a Point."""
    x, y, z = (float(getattr(message, axis)) for axis in "xyz")
    return x, y, z


def quaternion_of(message: QuaternionMsg) -> Quaternion:
    """Return a unit quaternion; the zero quaternion becomes the identity."""
    values = (message.x, message.y, message.z, message.w)
    length = math.sqrt(sum(value * value for value in values))
    if not length > 0:
        return (0.0, 0.0, 0.0, 1.0)
    x, y, z, w = (value / length for value in values)
    return x, y, z, w


def pose_of(message: PoseMsg) -> Pose:
    """Return the pose in a message."""
    return Pose(vector_of(message.position), quaternion_of(message.orientation))


def time_of(nanoseconds: int) -> Time:
    """Return the simulation's time as ROS time."""
    return Time(*divmod(nanoseconds, _BILLION))


def duration_seconds(duration: Duration) -> float:
    """Return a duration in seconds."""
    return duration.secs + duration.nsecs / _BILLION


def yaw_of(rotation: Quaternion) -> float:
    """Return the rotation about the vertical axis, in rad."""
    x, y, z, w = rotation
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
