"""libgazebo_ros_joint_state_publisher.so: publishes joint positions and velocities on joint_states."""

from __future__ import annotations

import re

from sensor_msgs.msg import JointState

from minirospy.ros.gazebo_ros.plugins import PeriodicPlugin

__all__ = ["JointStatePublisher"]


class JointStatePublisher(PeriodicPlugin):
    """Publishes joint states. Parameters: jointName (comma-separated; default: all joints), updateRate."""

    def load(self) -> None:
        """Find the joints."""
        self.default_namespace = self.model.name
        names = [name for name in re.split(r"[,\s]+", self.text("jointName")) if name]
        if not names:
            names = [joint.name for joint in self.model.joints.values() if joint.has_axis]
        self._joints = [self.joint(name) for name in names]
        self.rate = self.number("updateRate", 100.0)
        self._publisher = self.output_to("joint_states", JointState)

    def sense(self) -> None:
        """Publish the states."""
        message = JointState(header=self.header(""), name=[joint.name for joint in self._joints])
        message.position = [joint.position for joint in self._joints]
        message.velocity = [joint.velocity for joint in self._joints]
        self._publisher.publish(message)
