"""libgazebo_ros_planar_move.so: moves a whole model over the ground as commanded on /cmd_vel, and publishes /odom."""

from __future__ import annotations

import math

from minirospy.core.sdf.model import Pose
from minirospy.ros.gazebo_plugins.odometry import DrivePlugin
from minirospy.ros.gazebo_ros.messages import yaw_of
from minirospy.ros.gazebo_ros.plugins import Timer

__all__ = ["PlanarMove"]


class PlanarMove(DrivePlugin):
    """Moves the model as commanded on cmd_vel. Parameters: those of DrivePlugin, odometryRate, cmdTimeout."""

    def load(self) -> None:
        """Read the parameters."""
        self.rate = self.number("odometryRate", 20.0)
        self._timeout = self.number("cmdTimeout", -1.0)
        self.load_drive()

    def reset(self) -> None:
        """Stop the model and reset the odometry."""
        super().reset()
        self._odometry_timer = Timer(self.rate)
        self._last: tuple[int, Pose, float] | None = None  # the last message's time (ns), pose and yaw

    def update(self) -> None:
        """Set the model's velocity and publish the odometry."""
        now_ns = self.simulation.time_ns
        if 0 <= self._timeout < (now_ns - self.commanded_ns) / 1e9:
            self.command = (0.0, 0.0, 0.0)
        pose = self.model.pose
        yaw = yaw_of(pose.orientation)
        x, y, turn = self.command
        cos, sin = math.cos(yaw), math.sin(yaw)
        self.model.set_velocity((x * cos - y * sin, y * cos + x * sin, 0.0), (0.0, 0.0, turn))
        if self.rate > 0 and self._odometry_timer.is_due(now_ns):
            px, py, _ = pose.position
            velocity = self._mean_velocity(now_ns, pose, yaw)
            self.publish_odometry(pose._replace(position=(px, py, 0.0)), velocity, shown=pose)

    def _mean_velocity(self, now_ns: int, pose: Pose, yaw: float) -> tuple[float, float, float]:
        """Return the mean forward and left velocities and turn rate since the last message, as in Gazebo."""
        last, self._last = self._last, (now_ns, pose, yaw)
        if last is None or now_ns <= last[0]:
            return 0.0, 0.0, 0.0
        seconds = (now_ns - last[0]) / 1e9
        vx, vy = ((pose.position[axis] - last[1].position[axis]) / seconds for axis in (0, 1))
        cos, sin = math.cos(yaw), math.sin(yaw)
        turn = math.remainder(yaw - last[2], math.tau) / seconds
        return cos * vx + sin * vy, cos * vy - sin * vx, turn
