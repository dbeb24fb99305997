"""libgazebo_ros_skid_steer_drive.so: drives four wheels as commanded on /cmd_vel, and publishes /odom."""

from __future__ import annotations

from minirospy.ros.gazebo_plugins.odometry import DrivePlugin, body_velocity

__all__ = ["SkidSteerDrive"]

_WHEELS = (
    ("leftFrontJoint", "left_front_joint", -1),
    ("rightFrontJoint", "right_front_joint", 1),
    ("leftRearJoint", "left_rear_joint", -1),
    ("rightRearJoint", "right_rear_joint", 1),
)


class SkidSteerDrive(DrivePlugin):
    """libgazebo_ros_skid_steer_drive.so: drives four wheels by skid steering."""

    def load(self) -> None:
        """Start the wheel motors."""
        self._joints = [(self.joint(self.text(tag, name)), side) for tag, name, side in _WHEELS]
        self._separation = self.number("wheelSeparation", 0.4)
        self._radius = self.number("wheelDiameter", 0.15) / 2
        self._torque = self.number("torque", 5.0)
        self.rate = self.number("updateRate", 100.0)
        x, y = self.number("covariance_x", 1e-4), self.number("covariance_y", 1e-4)
        self.variances = (x, y, 1e12, 1e12, 1e12, self.number("covariance_yaw", 0.01))
        self.load_drive(has_transforms=self.flag("broadcastTF", False))

    def reset(self) -> None:
        """Stop the robot."""
        super().reset()
        for joint, _ in self._joints:
            joint.set_velocity(0.0, self._torque)

    def sense(self) -> None:
        """Publish the odometry and set the motors."""
        state = self.model.state
        self.publish_odometry(state.pose, body_velocity(state), shown=state.pose)
        speed, _, turn = self.command
        for joint, side in self._joints:
            joint.set_velocity((speed + side * turn * self._separation / 2) / self._radius, self._torque)
