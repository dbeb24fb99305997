"""libgazebo_ros_skid_steer_drive.so: drives four wheels as commanded on /cmd_vel, and publishes /odom."""

from __future__ import annotations

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from minirospy.ros.gazebo_plugins.odometry import TransformPublisher, body_velocity, is_usable, to_odometry
from minirospy.ros.gazebo_ros.plugins import ModelPlugin, Timer

__all__ = ["SkidSteerDrive"]

_WHEELS = (
    ("leftFrontJoint", "left_front_joint", -1),
    ("rightFrontJoint", "right_front_joint", 1),
    ("leftRearJoint", "left_rear_joint", -1),
    ("rightRearJoint", "right_rear_joint", 1),
)


class SkidSteerDrive(ModelPlugin):
    """The plugin."""

    def load(self) -> None:
        """Start the wheel motors."""
        self._joints = [(self.joint(self.text(tag, name)), side) for tag, name, side in _WHEELS]
        self._separation = self.number("wheelSeparation", 0.4)
        self._radius = self.number("wheelDiameter", 0.15) / 2
        self._torque = self.number("torque", 5.0)
        self._rate = self.number("updateRate", 100.0)
        self._frames = (
            self.frame("odometryFrame", "odom"),
            self.frame("robotBaseFrame", "base_footprint"),
        )
        x, y = self.number("covariance_x", 1e-4), self.number("covariance_y", 1e-4)
        self._variances = (x, y, 1e12, 1e12, 1e12, self.number("covariance_yaw", 0.01))
        self._odometry = self.publish_to(self.text("odometryTopic", "odom"), Odometry)
        self._transforms = TransformPublisher() if self.flag("broadcastTF", False) else None
        if self._transforms is not None:
            self._closing.append(self._transforms.close)
        self.reset()
        self.subscribe_to(self.text("commandTopic", "cmd_vel"), Twist, self._on_command)

    def reset(self) -> None:
        """Stop."""
        self._speed = self._turn = 0.0
        self._timer = Timer(self._rate)
        for joint, _ in self._joints:
            joint.set_velocity(0.0, self._torque)

    def _on_command(self, message: Twist) -> None:
        if not is_usable(message):
            return
        # Two floats: the simulation's thread reads both between two steps.
        self._speed, self._turn = message.linear.x, message.angular.z

    def update(self) -> None:
        """Publish, and set the motors."""
        if not self._timer.is_due(self.simulation.time_ns):
            return
        state = self.model.state
        if self._transforms is not None:
            self._transforms.send(self.now, *self._frames, state.pose)
        velocity = body_velocity(state)
        self._odometry.publish(to_odometry(self.now, self._frames, state.pose, velocity, self._variances))
        for joint, side in self._joints:
            speed = self._speed + side * self._turn * self._separation / 2
            joint.set_velocity(speed / self._radius, self._torque)
