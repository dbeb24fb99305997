"""Odometry messages and transforms of the plugins that drive robots."""

from __future__ import annotations

import math
from collections.abc import Sequence

from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from minirospy import client as rospy
from minirospy.base.times import Time
from minirospy.core.sdf.model import Pose, Quaternion
from minirospy.ros.gazebo_ros.messages import to_pose, yaw_of
from minirospy.ros.gazebo_ros.physics import State

__all__ = [
    "PlanarOdometry",
    "TransformPublisher",
    "body_velocity",
    "is_usable",
    "rotation_of_yaw",
    "to_odometry",
]


class TransformPublisher:
    """Publishes transforms on /tf."""

    def __init__(self) -> None:
        self._publisher = rospy.Publisher("/tf", TFMessage, queue_size=100)

    def send(self, stamp: Time, parent: str, child: str, pose: Pose) -> None:
        """Publish the pose of a frame in its parent's."""
        message = TransformStamped()
        message.header.stamp = stamp
        message.header.frame_id = parent
        message.child_frame_id = child
        translation = message.transform.translation
        translation.x, translation.y, translation.z = pose.position
        message.transform.rotation = to_pose(pose).orientation
        self._publisher.publish(TFMessage([message]))

    def close(self) -> None:
        """End publishing."""
        self._publisher.unregister()


class PlanarOdometry:
    """The pose of a robot on a plane, integrated from its speed and turn rate."""

    def __init__(self) -> None:
        self.x = self.y = self.yaw = 0.0

    def add(self, distance: float, turn: float) -> None:
        """Advance by a distance (m) along an arc that turns by ``turn`` (rad)."""
        self.x += distance * math.cos(self.yaw + turn / 2)
        self.y += distance * math.sin(self.yaw + turn / 2)
        self.yaw += turn

    @property
    def pose(self) -> Pose:
        """Return the pose."""
        return Pose((self.x, self.y, 0.0), rotation_of_yaw(self.yaw))


def rotation_of_yaw(yaw: float) -> Quaternion:
    """Return the rotation about z by an angle in rad."""
    return 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)


def body_velocity(state: State) -> tuple[float, float, float]:
    """Return the velocity forwards and to the left (m/s), and the turn rate (rad/s); as in Gazebo, only the yaw counts."""
    yaw = yaw_of(state.pose.orientation)
    vx, vy, _ = state.linear
    cos, sin = math.cos(yaw), math.sin(yaw)
    return cos * vx + sin * vy, cos * vy - sin * vx, state.angular[2]


def to_odometry(
    stamp: Time,
    frames: tuple[str, str],
    pose: Pose,
    velocity: tuple[float, float, float],
    variances: Sequence[float],
) -> Odometry:
    """Return a message. ``frames``: of the pose and of the velocity. ``variances``: the diagonal of the pose's covariance."""
    message = Odometry()
    message.header.stamp = stamp
    message.header.frame_id, message.child_frame_id = frames
    message.pose.pose = to_pose(pose)
    twist = message.twist.twist
    twist.linear.x, twist.linear.y, twist.angular.z = velocity
    covariance = [0.0] * 36
    covariance[::7] = variances
    message.pose.covariance = covariance
    return message


def is_usable(command: Twist) -> bool:
    """Return whether a command is finite; log an error if not."""
    linear, angular = command.linear, command.angular
    if all(map(math.isfinite, (linear.x, linear.y, angular.z))):
        return True
    rospy.logerr(
        "a velocity command that is not finite is ignored: x %s, y %s, turn %s", linear.x, linear.y, angular.z
    )
    return False
