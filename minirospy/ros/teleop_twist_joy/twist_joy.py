"""teleop_node: converts `joy` to `cmd_vel` while a button is held.

Parameters: ~enable_button (0), ~enable_turbo_button (-1: none), ~axis_linear (1), ~scale_linear (0.5),
~scale_linear_turbo (1.0), ~axis_angular (0), ~scale_angular (0.5), ~scale_angular_turbo (as scale_angular). An axis and
its scales may be maps from x, y, z and yaw, pitch, roll. Source: http://wiki.ros.org/teleop_twist_joy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy

from minirospy import client as rospy

__all__ = ["Direction", "JoyTeleop", "TeleopOptions", "Velocity", "main", "read_options"]


class Velocity(NamedTuple):
    """A velocity: linear in m/s, angular in rad/s."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0


class Direction(NamedTuple):
    """The joystick axis for one velocity component, and the scales applied to it."""

    axis: int
    normal: float
    turbo: float


@dataclass(frozen=True)
class TeleopOptions:
    """The buttons, and a Direction for each velocity component: linear (x, y, z) and angular (yaw, pitch, roll)."""

    enable_button: int = 0
    enable_turbo_button: int = -1
    linear: Mapping[str, Direction] = field(default_factory=dict)
    angular: Mapping[str, Direction] = field(default_factory=dict)


def read_options(parameters: Mapping[str, object]) -> TeleopOptions:
    """Return the options from the private parameters. As in roscpp, ignore a parameter of the wrong type and use its default."""
    linear = _directions(parameters, "linear", "x", 1, 1.0)
    angular = _directions(parameters, "angular", "yaw", 0, None)
    return TeleopOptions(
        _integer(parameters.get("enable_button"), 0),
        _integer(parameters.get("enable_turbo_button"), -1),
        linear,
        angular,
    )


def _directions(
    parameters: Mapping[str, object], kind: str, only: str, axis: int, turbo: float | None
) -> dict[str, Direction]:
    axes, scales = parameters.get(f"axis_{kind}"), parameters.get(f"scale_{kind}")
    turbos = parameters.get(f"scale_{kind}_turbo")
    if isinstance(axes, dict) and all(isinstance(each, int | float) for each in axes.values()):
        normal, fast = (value if isinstance(value, dict) else {} for value in (scales, turbos))
        return {
            str(name): Direction(_integer(each, 0), _real(normal.get(name), 0.0), _real(fast.get(name), 0.0))
            for name, each in sorted(axes.items())
        }
    scale = _real(scales, 0.5)
    return {only: Direction(_integer(axes, axis), scale, _real(turbos, scale if turbo is None else turbo))}


def _real(value: object, default: float) -> float:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else default


def _integer(value: object, default: int) -> int:
    return round(value) if isinstance(value, int | float) and not isinstance(value, bool) else default


class JoyTeleop:
    """Converts joystick states to velocities. Performs no I/O."""

    def __init__(self, options: TeleopOptions) -> None:
        self._options = options
        self._has_stopped = False

    def velocity(self, axes: Sequence[float], buttons: Sequence[int]) -> Velocity | None:
        """Return the velocity to publish. When the buttons are released, return zero velocity once, then None."""
        if self._is_held(buttons, self._options.enable_turbo_button):
            return self._moving(axes, is_fast=True)
        if self._is_held(buttons, self._options.enable_button):
            return self._moving(axes, is_fast=False)
        if self._has_stopped:
            return None
        self._has_stopped = True
        return Velocity()

    @staticmethod
    def _is_held(buttons: Sequence[int], number: int) -> bool:
        return 0 <= number < len(buttons) and bool(buttons[number])

    def _moving(self, axes: Sequence[float], *, is_fast: bool) -> Velocity:
        self._has_stopped = False
        fields = {}
        for names, directions in (
            (("x", "y", "z"), self._options.linear),
            (("roll", "pitch", "yaw"), self._options.angular),
        ):
            for name in names:
                direction = directions.get(name)
                if direction and 0 <= direction.axis < len(axes):
                    scale = direction.turbo if is_fast else direction.normal
                    fields[name] = axes[direction.axis] * scale
        return Velocity(**fields)


def main() -> int:
    """Run the node until it shuts down; return the exit status."""
    try:
        rospy.init_node("teleop_twist_joy_node")
        node = _TeleopNode()
        rospy.spin()
        del node
    except rospy.ROSInterruptException:
        pass
    return 0


class _TeleopNode:
    def __init__(self) -> None:
        found = rospy.get_param("~", {})
        options = read_options(found if isinstance(found, dict) else {})
        _log(options)
        self._teleop = JoyTeleop(options)
        self._publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1, latch=True)
        self._subscriber = rospy.Subscriber("joy", Joy, self._receive, queue_size=1)

    def _receive(self, joy: Joy) -> None:
        velocity = self._teleop.velocity(joy.axes, joy.buttons)
        if velocity is None:
            return
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z = velocity.x, velocity.y, velocity.z
        twist.angular.x, twist.angular.y, twist.angular.z = velocity.roll, velocity.pitch, velocity.yaw
        self._publisher.publish(twist)


def _log(options: TeleopOptions) -> None:
    rospy.loginfo("Teleop enable button %i.", options.enable_button)
    has_turbo = options.enable_turbo_button >= 0
    if has_turbo:
        rospy.loginfo("Turbo on button %i.", options.enable_turbo_button)
    for kind, directions in (("Linear", options.linear), ("Angular", options.angular)):
        for name, direction in directions.items():
            rospy.loginfo("%s axis %s on %i at scale %f.", kind, name, direction.axis, direction.normal)
            if has_turbo:
                text = "Turbo for %s axis %s is scale %f."
                rospy.loginfo(text, kind.lower(), name, direction.turbo)
