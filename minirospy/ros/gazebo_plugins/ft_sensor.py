"""libgazebo_ros_ft_sensor.so: publishes a joint's force and torque, from child to parent, in the child's frame."""

from __future__ import annotations

from geometry_msgs.msg import WrenchStamped

from minirospy.ros.gazebo_ros.messages import to_vector
from minirospy.ros.gazebo_ros.plugins import ModelPlugin, PluginError, Timer

__all__ = ["ForceTorque"]


class ForceTorque(ModelPlugin):
    """The plugin. Parameters: jointName, topicName, gaussianNoise, updateRate."""

    def load(self) -> None:
        """Find the joint."""
        name, topic = self.text("jointName"), self.text("topicName")
        if not name or not topic:
            raise PluginError(
                f"ft_sensor plugin missing <{'topicName' if name else 'jointName'}>, cannot proceed"
            )
        self.simulation.records_details = True
        self._joint = self.joint(name)
        self._noise = self.number("gaussianNoise", 0.0)
        self._rate = self.number("updateRate", 0.0)
        self._publisher = self.publish_to(topic, WrenchStamped)
        self.reset()

    def reset(self) -> None:
        """Begin the period again."""
        self._timer = Timer(self._rate)

    def update(self) -> None:
        """Publish if the period has passed."""
        if not self._timer.is_due(self.simulation.time_ns) or not self._publisher.get_num_connections():
            return
        wrench = self._joint.wrench()
        values = [*wrench.force, *wrench.torque]
        if self._noise > 0:
            drawn = self.simulation.random.normal(0.0, self._noise, 6).tolist()
            values = [a + b for a, b in zip(values, drawn, strict=True)]
        message = WrenchStamped()
        message.header.stamp = self.now
        message.header.frame_id = self._joint.record.child
        message.wrench.force = to_vector((values[0], values[1], values[2]))
        message.wrench.torque = to_vector((values[3], values[4], values[5]))
        self._publisher.publish(message)
