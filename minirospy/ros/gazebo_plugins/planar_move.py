"""libgazebo_ros_planar_move.so: moves a whole model over the ground as commanded on /cmd_vel, and publishes /odom."""

from __future__ import annotations

import math

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from minirospy.core.sdf.model import Pose
from minirospy.ros.gazebo_plugins.odometry import TransformPublisher, is_usable, to_odometry
from minirospy.ros.gazebo_ros.messages import yaw_of
from minirospy.ros.gazebo_ros.plugins import ModelPlugin, Timer

__all__ = ["PlanarMove"]

_VARIANCES = (1e-5, 1e-5, 1e12, 1e12, 1e12, 1e-3)


class PlanarMove(ModelPlugin):
    """The plugin. Parameters: commandTopic, odometryTopic, odometryFrame, robotBaseFrame, odometryRate, cmdTimeout."""

    def load(self) -> None:
        """Read the parameters."""
        self._rate = self.number("odometryRate", 20.0)
        self._timeout = self.number("cmdTimeout", -1.0)
        self._frames = (
            self.frame("odometryFrame", "odom"),
            self.frame("robotBaseFrame", "base_footprint"),
        )
        self._odometry = self.publish_to(self.text("odometryTopic", "odom"), Odometry)
        self._transforms = TransformPublisher()
        self._closing.append(self._transforms.close)
        self.reset()
        self.subscribe_to(self.text("commandTopic", "cmd_vel"), Twist, self._on_command)

    def reset(self) -> None:
        """Stop."""
        self._command = (0.0, 0.0, 0.0)
        self._commanded_ns = self.simulation.time_ns
        self._timer = Timer(self._rate)
        self._last: tuple[int, Pose, float] | None = None  # time in ns, pose and yaw of the last message

    def _on_command(self, message: Twist) -> None:
        if not is_usable(message):
            return
        self._command = (message.linear.x, message.linear.y, message.angular.z)
        self._commanded_ns = self.simulation.time_ns

    def update(self) -> None:
        """Set the model's velocity, and publish odometry."""
        now_ns = self.simulation.time_ns
        if 0 <= self._timeout < (now_ns - self._commanded_ns) / 1e9:
            self._command = (0.0, 0.0, 0.0)
        state = self.model.state
        yaw = yaw_of(state.pose.orientation)
        x, y, turn = self._command
        cos, sin = math.cos(yaw), math.sin(yaw)
        self.model.set_velocity((x * cos - y * sin, y * cos + x * sin, 0.0), (0.0, 0.0, turn))
        if self._rate > 0 and self._timer.is_due(now_ns):
            pose = state.pose
            self._transforms.send(self.now, *self._frames, pose)
            velocity = self._mean_velocity(now_ns, pose, yaw)
            px, py, _ = pose.position
            flat = pose._replace(position=(px, py, 0.0))
            self._odometry.publish(to_odometry(self.now, self._frames, flat, velocity, _VARIANCES))

    def _mean_velocity(self, now_ns: int, pose: Pose, yaw: float) -> tuple[float, float, float]:
        """Return the mean velocity forwards and to the left, and the mean turn rate, since the last message, as in Gazebo."""
        last, self._last = self._last, (now_ns, pose, yaw)
        if last is None or now_ns <= last[0]:
            return 0.0, 0.0, 0.0
        seconds = (now_ns - last[0]) / 1e9
        vx, vy = ((pose.position[axis] - last[1].position[axis]) / seconds for axis in (0, 1))
        cos, sin = math.cos(yaw), math.sin(yaw)
        turn = math.remainder(yaw - last[2], math.tau) / seconds
        return cos * vx + sin * vy, cos * vy - sin * vx, turn
