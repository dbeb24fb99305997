"""The base class of the plugins that drive robots: commands, odometry and transforms."""

from __future__ import annotations

import math
from typing import Any

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from minirospy import client as rospy
from minirospy.core.sdf.model import Pose
from minirospy.ros.gazebo_ros.messages import to_pose, yaw_of
from minirospy.ros.gazebo_ros.physics import State
from minirospy.ros.gazebo_ros.plugins import PeriodicPlugin

__all__ = ["DrivePlugin", "PlanarOdometry", "body_velocity"]


class DrivePlugin(PeriodicPlugin):
    """Base class for plugins that drive a robot with Twist commands and publish its odometry.

    Parameters: commandTopic, odometryTopic, odometryFrame, robotBaseFrame. command: the velocity forwards and to the left (m/s),
    and the turn rate (rad/s), of the last message. commanded_ns: its time. variances: the diagonal of the pose's covariance.
    """

    variances: tuple[float, ...] = (1e-5, 1e-5, 1e12, 1e12, 1e12, 1e-3)

    def load_drive(self, *, has_odometry: bool = True, has_transforms: bool = True) -> None:
        """Create the publishers and subscriber, after the subclass has read its parameters."""
        self._frames = (self.frame("odometryFrame", "odom"), self.frame("robotBaseFrame", "base_footprint"))
        self._odometry: rospy.Publisher[Any] | None = None
        if has_odometry:
            self._odometry = self.publish_to(self.text("odometryTopic", "odom"), Odometry)
        self._transforms: rospy.Publisher[Any] | None = None
        if has_transforms:
            self._transforms = rospy.Publisher("/tf", TFMessage, queue_size=100)
            self._closing.append(self._transforms.unregister)
        self.reset()
        self.subscribe_to(self.text("commandTopic", "cmd_vel"), Twist, self._on_command)

    def reset(self) -> None:
        """Discard the last command."""
        super().reset()
        self.command = (0.0, 0.0, 0.0)
        self.commanded_ns = self.simulation.time_ns

    def _on_command(self, message: Twist) -> None:
        linear, angular = message.linear, message.angular
        if not all(map(math.isfinite, (linear.x, linear.y, angular.z))):
            rospy.logerr(
                "a velocity command that is not finite is ignored: x %s, y %s, turn %s",
                linear.x,
                linear.y,
                angular.z,
            )
            return
        # Assign once: the simulation's thread reads the command between two steps.
        self.command = (linear.x, linear.y, angular.z)
        self.commanded_ns = self.simulation.time_ns

    def publish_odometry(
        self, pose: Pose, velocity: tuple[float, float, float], *, shown: Pose | None
    ) -> None:
        """Publish the odometry, if enabled. Unless ``shown`` is None, first publish that pose as a transform."""
        if self._odometry is None:
            return
        parent, child = self._frames
        if shown is not None:
            self.send_transform(parent, child, shown)
        message = Odometry(header=self.header(parent), child_frame_id=child)
        message.pose.pose = to_pose(pose)
        twist = message.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = velocity
        covariance = [0.0] * 36
        covariance[::7] = self.variances
        message.pose.covariance = covariance
        self._odometry.publish(message)

    def send_transform(self, parent: str, child: str, pose: Pose) -> None:
        """Publish a frame's pose relative to its parent on /tf, if transforms are enabled."""
        if self._transforms is not None:
            transform = Transform(Vector3(*pose.position), Quaternion(*pose.orientation))
            self._transforms.publish(TFMessage([TransformStamped(self.header(parent), child, transform)]))


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
        return Pose((self.x, self.y, 0.0), (0.0, 0.0, math.sin(self.yaw / 2), math.cos(self.yaw / 2)))


def body_velocity(state: State) -> tuple[float, float, float]:
    """Return the forward and left velocities (m/s) and the turn rate (rad/s). As in Gazebo, ignore roll and pitch."""
    yaw = yaw_of(state.pose.orientation)
    vx, vy, _ = state.linear
    cos, sin = math.cos(yaw), math.sin(yaw)
    return cos * vx + sin * vy, cos * vy - sin * vx, state.angular[2]
