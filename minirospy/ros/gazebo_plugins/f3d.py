"""libgazebo_ros_f3d.so: publishes the force and torque that programs and plugins apply to a link."""

from __future__ import annotations

from geometry_msgs.msg import WrenchStamped

from minirospy.ros.gazebo_ros.messages import to_vector
from minirospy.ros.gazebo_ros.plugins import PeriodicPlugin

__all__ = ["F3D"]


class F3D(PeriodicPlugin):
    """libgazebo_ros_f3d.so. Parameters: bodyName, topicName, frameName. World frame, without contact forces."""

    def load(self) -> None:
        """Find the link."""
        body, topic = (self.required(tag, "f3d plugin") for tag in ("bodyName", "topicName"))
        self._link, _ = self.link(body)
        self._frame = self.frame("frameName", "world")
        self._publisher = self.output_to(topic, WrenchStamped)

    def sense(self) -> None:
        """Publish the sum of the forces and torques applied to the link."""
        now = self.simulation.time
        active = [each for each in self._link.wrenches if each.start <= now]
        message = WrenchStamped(header=self.header(self._frame))
        for part in ("force", "torque"):
            x, y, z = (sum(getattr(each, part)[axis] for each in active) for axis in range(3))
            setattr(message.wrench, part, to_vector((x, y, z)))
        self._publisher.publish(message)
