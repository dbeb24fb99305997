"""The joints that a controller commands, and the topic ``command``, which carries one number per joint."""

from __future__ import annotations

import math
from collections.abc import Sequence

from std_msgs.msg import Float64, Float64MultiArray

from minirospy import client as rospy
from minirospy.core.control.controller import ControllerContext, ControllerError, Resources
from minirospy.core.control.hardware import HardwareError, Interface, Joint

__all__ = ["CommandTopic", "claim_group", "claim_joint"]


def claim_joint(hardware: Resources, context: ControllerContext, interface: Interface) -> Joint:
    """Return the joint named by the parameter ``joint``. Raise ControllerError or HardwareError if there is no such joint."""
    if not (name := context.parameters.text("joint", "")):
        raise ControllerError(f"No joint given (namespace: {context.namespace})")
    return hardware.joint(name, interface)


def claim_group(hardware: Resources, context: ControllerContext, interface: Interface) -> list[Joint]:
    """Return the joints listed in the parameter ``joints``. Raise ControllerError if the list is empty or has duplicates."""
    names = context.parameters.names("joints")
    if names is None:
        raise ControllerError(f"Failed to getParam 'joints' (namespace: {context.namespace}).")
    if not names:
        raise ControllerError("List of joint names is empty.")
    if len(set(names)) < len(names):
        raise ControllerError(f"A joint is listed twice in {names} (namespace: {context.namespace}).")
    try:
        return [hardware.joint(name, interface) for name in names]
    except HardwareError as error:
        raise ControllerError(f"Exception thrown: {error}") from error


class CommandTopic:
    """A controller's topic ``command``.

    ``values``: the last command for each joint. Messages and the controller's ``starting`` replace the list as a whole.
    """

    def __init__(self, context: ControllerContext, joints: int, *, is_group: bool) -> None:
        """Subscribe to Float64MultiArray for a group of joints, to Float64 for a single joint."""
        self.values: Sequence[float] = (0.0,) * joints
        self._name = f"{context.namespace}/command"
        self._subscriber = rospy.Subscriber(
            self._name,
            Float64MultiArray if is_group else Float64,
            self._receive_group if is_group else self._receive,
            queue_size=1,
        )

    def close(self) -> None:
        """Unsubscribe from the topic."""
        self._subscriber.unregister()

    def _receive(self, message: Float64) -> None:
        self._set((message.data,))

    def _receive_group(self, message: Float64MultiArray) -> None:
        if len(message.data) != len(self.values):
            rospy.logerr(
                "Dimension of command (%d) does not match number of joints (%d)! Not executing!",
                len(message.data),
                len(self.values),
            )
            return
        self._set(tuple(message.data))

    def _set(self, values: Sequence[float]) -> None:
        if all(map(math.isfinite, values)):
            self.values = values
        else:
            rospy.logwarn_throttle(1.0, f"Command on {self._name} is not finite: {list(values)}. Ignoring.")
