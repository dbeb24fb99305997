"""libgazebo_ros_p3d.so: publishes the true pose and velocity of a link as odometry."""

from __future__ import annotations

from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry

from minirospy.core.sdf.model import Pose
from minirospy.core.sdf.poses import add, compose
from minirospy.ros.gazebo_plugins.imu import offset_of
from minirospy.ros.gazebo_ros.frames import relative_state
from minirospy.ros.gazebo_ros.messages import to_pose
from minirospy.ros.gazebo_ros.physics import State
from minirospy.ros.gazebo_ros.plugins import PeriodicPlugin

__all__ = ["P3D"]

_WORLD_FRAMES = ("world", "/world", "map", "/map")


class P3D(PeriodicPlugin):
    """A link's odometry. Parameters: bodyName, topicName, frameName, xyzOffset, rpyOffset, gaussianNoise, updateRate."""

    def load(self) -> None:
        """Find the links."""
        self._body, topic = (self.required(tag, "p3d plugin") for tag in ("bodyName", "topicName"))
        self._link, self._place = self.link(self._body)
        self._offset = offset_of(self)
        self._noise = self.number("gaussianNoise", 0.0)
        self.rate = self.number("updateRate", 0.0)
        self._frame = self.text("frameName", "world")
        self._reference = None if self._frame in _WORLD_FRAMES else self.link(self._frame)
        self._publisher = self.output_to(topic, Odometry)

    def sense(self) -> None:
        """Publish a measurement."""
        state = self._link.state
        state = State(compose(state.pose, self._place), state.linear, state.angular)
        if self._reference is not None:
            link, place = self._reference
            base = link.state
            state = relative_state(state, State(compose(base.pose, place), base.linear, base.angular))
        position = add(state.pose.position, self._offset.position)
        rotation = compose(
            self._offset._replace(position=(0.0, 0.0, 0.0)), state.pose._replace(position=(0.0, 0.0, 0.0))
        ).orientation
        message = Odometry(header=self.header(self._frame.lstrip("/")), child_frame_id=self._body)
        message.pose.pose = to_pose(Pose(position, rotation))
        values = self.noisy((*state.linear, *state.angular), self._noise)
        message.twist.twist = Twist(Vector3(*values[:3]), Vector3(*values[3:]))
        variance = self._noise * self._noise
        diagonal = [variance if index % 7 == 0 else 0.0 for index in range(36)]
        message.pose.covariance = message.twist.covariance = diagonal
        self._publisher.publish(message)
