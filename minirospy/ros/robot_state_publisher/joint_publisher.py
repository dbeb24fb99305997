"""joint_state_publisher: publishes joint_states from a description, zero positions and other nodes' joint states.

Parameters, private or in the node's namespace: robot_description, rate (10 Hz), dependent_joints
(``{joint: {parent, factor, offset}}``), use_mimic_tags, use_smallest_joint_limits (true), source_list (topics), zeros
(``{joint: position}``), delta (radians or metres per message), publish_default_positions (true),
publish_default_velocities, publish_default_efforts (false). Source: http://wiki.ros.org/joint_state_publisher.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from sensor_msgs.msg import JointState

from minirospy import client as rospy
from minirospy.ros.robot_state_publisher.joint_parameters import read_parameters
from minirospy.ros.robot_state_publisher.joints import JointError, read_joints

__all__ = ["JointPublisher", "main", "param", "run_node"]

_CONNECT_SECONDS = 0.5


def main() -> int:
    """Run the node until it shuts down; return 1 if there are no joints to publish, else 0."""
    return run_node("joint_state_publisher", lambda: JointPublisher().loop())


def run_node(name: str, body: Callable[[], object]) -> int:
    """Initialize a node and run ``body``; return the exit status. On a JointError, log the error and return 1."""
    try:
        rospy.init_node(name)
        body()
    except JointError as error:
        rospy.logerr("%s", error)
        return 1
    except rospy.ROSInterruptException:
        pass
    return 0


def param(name: str, default: object = None) -> object:
    """Return a parameter's private value, else its value in the node's namespace, else the default."""
    for key in (f"~{name}", name):
        if rospy.has_param(key):
            return rospy.get_param(key)
    return default


class JointPublisher:
    """Publishes the joint states and subscribes to the topics in source_list. Raise JointError if a parameter is invalid.

    ``on_update`` is called after each message from a source.
    """

    def __init__(self, on_update: Callable[[], object] = lambda: None) -> None:
        # Read both parameters: a joint missing from ~zeros may be in zeros.
        zeros = [rospy.get_param(key, {}) for key in ("~zeros", "zeros")]
        found = read_parameters(param, zeros)
        self.lock = threading.Lock()
        self.joints = read_joints(found.description, found.options, lambda line: rospy.logwarn("%s", line))
        self._rate, self._delta = found.rate, found.delta
        self._on_update = on_update
        self._publisher = rospy.Publisher("joint_states", JointState, queue_size=5)
        self._subscribers = [rospy.Subscriber(topic, JointState, self._follow) for topic in found.sources]

    def loop(self) -> None:
        """Publish until the node shuts down."""
        self._publisher.wait_for_subscribers(timeout=min(1 / self._rate, _CONNECT_SECONDS))
        rate = rospy.Rate(self._rate)
        while not rospy.is_shutdown():
            self.publish()
            try:
                rate.sleep()
            except rospy.ROSTimeMovedBackwardsException:
                pass

    def publish(self) -> None:
        """Publish the state of all joints, if there are any."""
        with self.lock:
            if self._delta > 0:
                self.joints.advance(self._delta)
            values = self.joints.values()
        if values.name:
            state = JointState(name=values.name, position=values.position)
            state.velocity, state.effort = values.velocity, values.effort
            state.header.stamp = rospy.Time.now()
            self._publisher.publish(state)

    def _follow(self, state: JointState) -> None:
        with self.lock:
            self.joints.update(state.name, state.position, state.velocity, state.effort)
        self._on_update()
