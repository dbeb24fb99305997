"""libgazebo_ros_joint_state_publisher.so: publishes joint positions and velocities on joint_states."""

from __future__ import annotations

import re

from sensor_msgs.msg import JointState

from minirospy.ros.gazebo_ros.plugins import ModelPlugin, Timer

__all__ = ["JointStatePublisher"]


class JointStatePublisher(ModelPlugin):
    """The plugin. Parameters: jointName (names with commas; default: all joints), updateRate."""

    def load(self) -> None:
        """Find the joints."""
        self.default_namespace = self.model.name
        names = [name for name in re.split(r"[,\s]+", self.text("jointName")) if name]
        if not names:
            names = [joint.name for joint in self.model.joints.values() if joint.has_axis]
        self._joints = [self.joint(name) for name in names]
        self._rate = self.number("updateRate", 100.0)
        self._timer = Timer(self._rate)
        self._publisher = self.publish_to("joint_states", JointState)

    def reset(self) -> None:
        """Begin the period again."""
        self._timer = Timer(self._rate)

    def update(self) -> None:
        """Publish if the period has passed."""
        if not self._timer.is_due(self.simulation.time_ns):
            return
        message = JointState(name=[joint.name for joint in self._joints])
        message.header.stamp = self.now
        message.position = [joint.position for joint in self._joints]
        message.velocity = [joint.velocity for joint in self._joints]
        self._publisher.publish(message)
