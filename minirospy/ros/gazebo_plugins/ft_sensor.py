"""libgazebo_ros_ft_sensor.so: publishes a joint's force and torque, from child to parent, in the child's frame."""

from __future__ import annotations

from geometry_msgs.msg import Vector3, Wrench, WrenchStamped

from minirospy.ros.gazebo_ros.plugins import PeriodicPlugin

__all__ = ["ForceTorque"]


class ForceTorque(PeriodicPlugin):
    """libgazebo_ros_ft_sensor.so. Parameters: jointName, topicName, gaussianNoise, updateRate."""

    def load(self) -> None:
        """Find the joint."""
        name, topic = (self.required(tag, "ft_sensor plugin") for tag in ("jointName", "topicName"))
        self.simulation.records_details = True
        self._joint = self.joint(name)
        self._noise = self.number("gaussianNoise", 0.0)
        self.rate = self.number("updateRate", 0.0)
        self._publisher = self.output_to(topic, WrenchStamped)

    def sense(self) -> None:
        """Publish a measurement."""
        force, torque = self._joint.wrench()
        values = self.noisy((*force, *torque), self._noise)
        wrench = Wrench(Vector3(*values[:3]), Vector3(*values[3:]))
        self._publisher.publish(WrenchStamped(self.header(self._joint.record.child), wrench))
