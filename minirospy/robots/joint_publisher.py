"""joint_state_publisher: a description's joints, their zeros and what other nodes publish of them -> joint_states.

Parameters, private ones first, else of the node's namespace: robot_description, rate (10 Hz), dependent_joints
(``{joint: {parent, factor, offset}}``), use_mimic_tags, use_smallest_joint_limits (true), source_list (topics), zeros
(``{joint: position}``), delta (radians or metres a message), publish_default_positions (true), publish_default_velocities,
publish_default_efforts (false). Source: http://wiki.ros.org/joint_state_publisher.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from sensor_msgs.msg import JointState

from minirospy import client as rospy
from minirospy.robots.joints import Dependent, JointError, JointOptions, read_joints

__all__ = ["JointPublisher", "main", "param", "run_node"]

_CONNECT_SECONDS = 0.5


def main() -> int:
    """Run the node until it is shut down; return the exit status: 1 where there are no joints to publish."""
    return run_node("joint_state_publisher", lambda: JointPublisher().loop())


def run_node(name: str, body: Callable[[], object]) -> int:
    """Initialise a node and run it; return the exit status: 1 for a JointError, which is logged."""
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
    """Return a private parameter, else the one of the node's namespace, else the default."""
    for key in (f"~{name}", name):
        if rospy.has_param(key):
            return rospy.get_param(key)
    return default


class JointPublisher:
    """The joints as a node: publishes them, and follows the topics of source_list. Raises JointError.

    ``on_update`` is called when a message of a source has come.
    """

    def __init__(self, on_update: Callable[[], object] = lambda: None) -> None:
        description = param("robot_description")
        if not isinstance(description, str):
            raise JointError("The robot_description parameter is required and not set.")
        self.lock = threading.Lock()
        self.joints = read_joints(description, _options(), lambda line: rospy.logwarn("%s", line))
        self._rate = _number("rate", 10.0)
        if self._rate <= 0:
            raise JointError(
                f"The rate parameter is {self._rate:g}: it is a number of messages a second, above 0"
            )
        self._delta = _number("delta", 0.0)
        self._on_update = on_update
        self._publisher = rospy.Publisher("joint_states", JointState, queue_size=5)
        sources = param("source_list", [])
        if not isinstance(sources, list):
            raise JointError(f"The source_list parameter is [{sources}]: it is a list of topics")
        self._subscribers = [rospy.Subscriber(str(topic), JointState, self._follow) for topic in sources]

    def loop(self) -> None:
        """Publish until the node is shut down."""
        self._publisher.wait_for_subscribers(timeout=min(1 / self._rate, _CONNECT_SECONDS))
        rate = rospy.Rate(self._rate)
        while not rospy.is_shutdown():
            self.publish()
            try:
                rate.sleep()
            except rospy.ROSTimeMovedBackwardsException:
                pass

    def publish(self) -> None:
        """Publish the state of all joints; nothing where there are none."""
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


def _options() -> JointOptions:
    zeros = [rospy.get_param(key, {}) for key in ("~zeros", "zeros")]
    return JointOptions(
        dependent_joints=_dependent_joints(param("dependent_joints", {})),
        use_mimic_tags=bool(param("use_mimic_tags", True)),
        use_smallest_joint_limits=bool(param("use_smallest_joint_limits", True)),
        zero=lambda joint: _zero(zeros, joint),
        publish_default_positions=bool(param("publish_default_positions", True)),
        publish_default_velocities=bool(param("publish_default_velocities", False)),
        publish_default_efforts=bool(param("publish_default_efforts", False)),
    )


def _zero(zeros: list[object], joint: str) -> float | None:
    """Return a joint's zero, the private one first. Slashes of its name are levels of the parameter."""
    for tree in zeros:
        value: object = tree
        for part in joint.split("/"):
            value = value.get(part) if isinstance(value, dict) else None
        if value is not None:
            return _as_number(f"zeros/{joint}", value)
    return None


def _dependent_joints(value: object) -> dict[str, Dependent]:
    if not isinstance(value, dict):
        raise JointError(
            f"The dependent_joints parameter is [{value}]: it is as {{joint: {{parent: other}}}}"
        )
    found = {}
    for name, rule in value.items():
        if not isinstance(rule, dict) or not isinstance(rule.get("parent"), str):
            raise JointError(f"The dependent_joints parameter has no parent for joint [{name}]")
        factor, offset = (
            _as_number(f"dependent_joints/{name}/{key}", rule.get(key, default))
            for key, default in (("factor", 1.0), ("offset", 0.0))
        )
        found[str(name)] = Dependent(rule["parent"], factor, offset)
    return found


def _number(name: str, default: float) -> float:
    return _as_number(name, param(name, default))


def _as_number(name: str, value: object) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise JointError(f"The {name} parameter is [{value}]: it is a number")
    return float(value)
