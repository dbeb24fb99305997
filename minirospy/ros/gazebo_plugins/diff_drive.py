"""libgazebo_ros_diff_drive.so: drives two wheels as commanded on /cmd_vel, and publishes /odom and its transform."""

from __future__ import annotations

from sensor_msgs.msg import JointState

from minirospy.core.sdf.poses import relative
from minirospy.ros.gazebo_plugins.odometry import DrivePlugin, PlanarOdometry, body_velocity
from minirospy.ros.gazebo_ros.physics import SimJoint

__all__ = ["DiffDrive"]

_NEAR_SPEED = 0.01  # m/s: a wheel within this difference of its target speed is not accelerated


class DiffDrive(DrivePlugin):
    """libgazebo_ros_diff_drive.so: a differential drive."""

    def load(self) -> None:
        """Start the wheel motors."""
        self.default_namespace = self.model.name
        self._joints = (
            self.joint(self.text("leftJoint", "left_joint")),
            self.joint(self.text("rightJoint", "right_joint")),
        )
        self._separation = self.number("wheelSeparation", 0.34)
        self._radius = self.number("wheelDiameter", 0.15) / 2
        self._acceleration = self.number("wheelAcceleration", 0.0)
        self._torque = self.number("wheelTorque", 5.0)
        rate = self.number("updateRate", 100.0)
        self._period_ns = round(1e9 / rate) if rate > 0 else 0
        self._uses_encoders = self.text("odometrySource", "world") == "encoder"
        self._publishes_transform = self.flag("publishOdomTF", True)
        self._publishes_wheels = self.flag("publishWheelTF", False)
        self._states = None
        if self.flag("publishWheelJointState", False):
            self._states = self.publish_to("joint_states", JointState)
        self.load_drive(has_odometry=self.flag("publishTf", True))

    def reset(self) -> None:
        """Stop the wheels, and restart the odometry at the origin."""
        super().reset()
        self._encoders = PlanarOdometry()
        self._encoder_speed = (0.0, 0.0, 0.0)
        self._instructed = [0.0, 0.0]
        self._last_ns = self._last_encoder_ns = self.simulation.time_ns
        for joint in self._joints:
            joint.set_velocity(0.0, self._torque)

    def update(self) -> None:
        """Publish the odometry and set the motors' speeds."""
        now_ns = self.simulation.time_ns
        if self._uses_encoders:
            self._read_encoders(now_ns)
        elapsed = now_ns - self._last_ns
        if elapsed < self._period_ns:
            return
        self._last_ns = now_ns
        if not self._uses_encoders:
            self.due_ns = now_ns + self._period_ns
        self._publish()
        speed, _, turn = self.command
        turn *= self._separation / 2
        self._drive((speed - turn, speed + turn), elapsed / 1e9)

    def _drive(self, targets: tuple[float, float], seconds: float) -> None:
        speeds = [joint.velocity * self._radius for joint in self._joints]
        is_near = any(
            abs(target - speed) < _NEAR_SPEED for target, speed in zip(targets, speeds, strict=True)
        )
        if self._acceleration == 0 or is_near:
            self._instructed = list(targets)
        else:
            limit = self._acceleration * seconds
            for index, (target, speed) in enumerate(zip(targets, speeds, strict=True)):
                self._instructed[index] += min(max(target - speed, -limit), limit)
        for joint, speed in zip(self._joints, self._instructed, strict=True):
            joint.set_velocity(speed / self._radius, self._torque)

    def _read_encoders(self, now_ns: int) -> None:
        seconds = (now_ns - self._last_encoder_ns) / 1e9
        self._last_encoder_ns = now_ns
        left, right = (joint.velocity * self._radius for joint in self._joints)
        speed, turn = (left + right) / 2, (right - left) / self._separation
        self._encoders.add(speed * seconds, turn * seconds)
        self._encoder_speed = (speed, 0.0, turn)

    def _publish(self) -> None:
        pose, velocity = self._encoders.pose, self._encoder_speed
        if not self._uses_encoders:
            state = self.model.state
            pose, velocity = state.pose, body_velocity(state)
        self.publish_odometry(pose, velocity, shown=pose if self._publishes_transform else None)
        if self._publishes_wheels:
            for joint in self._joints:
                self._send_wheel(joint)
        if self._states is not None:
            states = JointState(header=self.header(""), name=[joint.name for joint in self._joints])
            states.position = [joint.position for joint in self._joints]
            self._states.publish(states)

    def _send_wheel(self, joint: SimJoint) -> None:
        parent, child = joint.record.parent, joint.record.child
        if parent in self.model.links:
            pose = relative(self.model.links[parent].pose, self.model.links[child].pose)
            self.send_transform(parent, child, pose)
