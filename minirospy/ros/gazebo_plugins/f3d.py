"""libgazebo_ros_f3d.so: publishes the force and torque that programs and plugins apply to a link."""

from __future__ import annotations

from geometry_msgs.msg import WrenchStamped

from minirospy.ros.gazebo_ros.messages import to_vector
from minirospy.ros.gazebo_ros.plugins import ModelPlugin, PluginError

__all__ = ["F3D"]


class F3D(ModelPlugin):
    """The plugin. Parameters: bodyName, topicName, frameName. The vectors are in world axes, and do not contain contacts."""

    def load(self) -> None:
        """Find the link."""
        for tag in ("bodyName", "topicName"):
            if not self.text(tag):
                raise PluginError(f"f3d plugin missing <{tag}>, cannot proceed")
        self._link, _ = self.link(self.text("bodyName"))
        self._frame = self.frame("frameName", "world")
        self._publisher = self.publish_to(self.text("topicName"), WrenchStamped)

    def update(self) -> None:
        """Publish in each step if there is a subscriber."""
        if not self._publisher.get_num_connections():
            return
        now = self.simulation.time
        active = [each for each in self._link.wrenches if each.start <= now]
        message = WrenchStamped()
        message.header.stamp = self.now
        message.header.frame_id = self._frame
        for part in ("force", "torque"):
            x, y, z = (sum(getattr(each, part)[axis] for each in active) for axis in range(3))
            setattr(message.wrench, part, to_vector((x, y, z)))
        self._publisher.publish(message)
