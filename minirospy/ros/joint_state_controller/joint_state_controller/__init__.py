"""The controller that publishes the state of joints: ``from joint_state_controller import JointStateController``.

Source: http://wiki.ros.org/joint_state_controller.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from sensor_msgs.msg import JointState

from minirospy import client as rospy
from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, ControllerError, Resources
from minirospy.core.control.hardware import Interface
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.rates import PublishRate
from minirospy.ros.realtime_tools.realtime_tools import RealtimePublisher

__all__ = ["JointStateController"]

_STATE = ("position", "velocity", "effort")
_XMLRPC_TYPES = {
    bool: 1,
    int: 2,
    float: 3,
    str: 4,
    list: 7,
}  # XmlRpcValue's type numbers, which ROS prints


class JointStateController(Controller):
    """Publishes ``joint_states``: all joints or those in ``joints``, plus ``extra_joints``, whose states are constant."""

    interfaces = (Interface.JOINT_STATE,)

    _has_started = False

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Find the joints and create the publisher. Raise ControllerError if ``publish_rate`` is not set."""
        names = context.parameters.names("joints")
        if names is None:
            names = list(hardware.names(Interface.JOINT_STATE))
        else:
            rospy.loginfo("Joints parameter specified, publishing specified joints in desired order.")
        self._rate = PublishRate.read(context.parameters)
        self._joints = [hardware.joint_state(name) for name in names]
        extra = list(_extra_joints(context.parameters, names))
        self._names = names + [name for name, _ in extra]
        self._extra = tuple([values[each] for _, values in extra] for each in _STATE)
        topic = f"{context.root.rstrip('/')}/joint_states"
        self._publisher = RealtimePublisher(topic, JointState, queue_size=4)
        self.opened.callback(self._publisher.close)

    def starting(self, time: Time) -> None:
        """At the first start, make the first message due in the next cycle. After a restart, keep the publishing schedule."""
        if not self._has_started:
            self._rate.start(time, is_due=True)
            self._has_started = True

    def update(self, time: Time, period: Duration) -> None:
        """Publish the joint states."""
        if not self._rate.is_due(time):
            return
        joints, (positions, velocities, efforts) = self._joints, self._extra
        message = JointState(
            name=self._names,
            position=[joint.position for joint in joints] + positions,
            velocity=[joint.velocity for joint in joints] + velocities,
            effort=[joint.effort for joint in joints] + efforts,
        )
        message.header.stamp = time
        self._publisher.publish(message)


def _extra_joints(parameters: Parameters, names: list[str]) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield each extra joint's name and state; ignore invalid ones and log the reason."""
    listed = parameters.get("extra_joints")
    if listed is None:
        return
    if not isinstance(listed, list):
        rospy.logerr("Extra joints specification is not an array. Ignoring.")
        return
    known = set(names)
    for each in listed:
        if not isinstance(each, Mapping):
            rospy.logerr(
                "Extra joint specification is not a struct, but rather '%d'. Ignoring.",
                _XMLRPC_TYPES.get(type(each), 0),
            )
            continue
        if "name" not in each:
            rospy.logerr("Extra joint does not specify name. Ignoring.")
            continue
        name = each["name"]
        if not isinstance(name, str):
            raise ControllerError(f"the name of an extra joint is {name!r}: it must be a string")
        if name in known:
            rospy.logwarn("Joint state interface already contains specified extra joint '%s'.", name)
            continue
        state = {key: each.get(key, 0.0) for key in _STATE}
        wrong = [key for key, value in state.items() if not isinstance(value, float)]
        if wrong:
            rospy.logerr("Extra joint '%s' does not specify a valid default %s. Ignoring.", name, wrong[0])
            continue
        known.add(name)
        yield name, state
