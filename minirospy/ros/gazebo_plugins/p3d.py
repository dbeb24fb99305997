"""libgazebo_ros_p3d.so: publishes the true pose and velocity of a link as odometry."""

from __future__ import annotations

from nav_msgs.msg import Odometry

from minirospy.core.sdf.poses import compose
from minirospy.ros.gazebo_plugins.imu import offset_of
from minirospy.ros.gazebo_ros.frames import relative_state
from minirospy.ros.gazebo_ros.messages import to_pose, to_twist
from minirospy.ros.gazebo_ros.physics import State
from minirospy.ros.gazebo_ros.plugins import ModelPlugin, PluginError, Timer

__all__ = ["P3D"]

_WORLD_FRAMES = ("world", "/world", "map", "/map")


class P3D(ModelPlugin):
    """The plugin. Parameters: bodyName, topicName, frameName, xyzOffset, rpyOffset, gaussianNoise, updateRate."""

    def load(self) -> None:
        """Find the links."""
        body = self.text("bodyName")
        topic = self.text("topicName")
        if not body or not topic:
            raise PluginError(f"p3d plugin missing <{'topicName' if body else 'bodyName'}>, cannot proceed")
        self._body = body
        self._link, self._place = self.link(body)
        self._offset = offset_of(self)
        self._noise = self.number("gaussianNoise", 0.0)
        self._rate = self.number("updateRate", 0.0)
        self._frame = self.text("frameName", "world")
        self._reference = None if self._frame in _WORLD_FRAMES else self.link(self._frame)
        self._publisher = self.publish_to(topic, Odometry)
        self.reset()

    def reset(self) -> None:
        """Begin the period again."""
        self._timer = Timer(self._rate)

    def update(self) -> None:
        """Publish if the period has passed."""
        if not self._timer.is_due(self.simulation.time_ns) or not self._publisher.get_num_connections():
            return
        state = self._link.state
        state = State(compose(state.pose, self._place), state.linear, state.angular)
        if self._reference is not None:
            link, place = self._reference
            base = link.state
            state = relative_state(state, State(compose(base.pose, place), base.linear, base.angular))
        x, y, z = (a + b for a, b in zip(state.pose.position, self._offset.position, strict=True))
        rotation = compose(
            self._offset._replace(position=(0.0, 0.0, 0.0)), state.pose._replace(position=(0.0, 0.0, 0.0))
        ).orientation
        message = Odometry(child_frame_id=self._body)
        message.header.stamp = self.now
        message.header.frame_id = self._frame.lstrip("/")
        message.pose.pose = to_pose(state.pose._replace(position=(x, y, z), orientation=rotation))
        values = (*state.linear, *state.angular)
        if self._noise > 0:
            drawn = self.simulation.random.normal(0.0, self._noise, 6).tolist()
            values = tuple(a + b for a, b in zip(values, drawn, strict=True))
        message.twist.twist = to_twist(values[:3], values[3:])
        variance = self._noise * self._noise
        diagonal = [variance if index % 7 == 0 else 0.0 for index in range(36)]
        message.pose.covariance = message.twist.covariance = diagonal
        self._publisher.publish(message)
