"""The controller for a base with differential drive: ``from diff_drive_controller import DiffDriveController``.

Source: http://wiki.ros.org/diff_drive_controller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from control_msgs.msg import JointTrajectoryControllerState
from geometry_msgs.msg import TwistStamped
from trajectory_msgs.msg import JointTrajectoryPoint

from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import ControllerContext, ControllerError, Resources
from minirospy.core.control.hardware import Interface, Joint
from minirospy.core.control.odometry import DiffDriveOdometry, Odometry
from minirospy.core.control.parameters import Parameters
from minirospy.ros.diff_drive_controller.diff_drive_controller.cfg import DiffDriveControllerConfig
from minirospy.ros.diff_drive_controller.mobile_base import (
    MobileBase,
    described_joint,
    enabled,
    log_origin,
    read_robot,
    wheel_radius,
)
from minirospy.ros.dynamic_reconfigure.definition import close_server
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.encoding import Config
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.server import Server
from minirospy.ros.realtime_tools.realtime_tools import RealtimePublisher

__all__ = ["DiffDriveController"]


_RECONFIGURED = """Dynamic Reconfigure:
DynamicParams:
\tOdometry parameters:
\t\tleft wheel radius multiplier: {left_wheel_radius_multiplier:g}
\t\tright wheel radius multiplier: {right_wheel_radius_multiplier:g}
\t\twheel separation multiplier: {wheel_separation_multiplier:g}
\tPublication parameters:
\t\tPublish executed velocity command: disabled
\t\tPublication rate: {publish_rate:g}
\t\tPublish frame odom on tf: {tf}"""


class _Wheels(NamedTuple):
    """The wheels' geometry in metres, or correction factors for it."""

    separation: float
    left_radius: float
    right_radius: float


class DiffDriveController(MobileBase):
    """Drives the wheels named in ``left_wheel`` and ``right_wheel``; each parameter is a name or a list of names."""

    interfaces = (Interface.VELOCITY,)

    _cmd_vel_out: RealtimePublisher[TwistStamped] | None = None
    _wheel_states: _WheelStates | None = None

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Read the parameters, claim the wheels and create the publishers and subscriber."""
        parameters = context.parameters
        left, right = _wheel_names(parameters, "left_wheel"), _wheel_names(parameters, "right_wheel")
        if len(left) != len(right):
            raise ControllerError(f"#left wheels ({len(left)}) != #right wheels ({len(right)}).")
        hertz = self.read_rate(context)
        factors = self._read_factors(parameters)
        self.read_parameters(context)
        self._described = self._read_geometry(context, left[0], right[0])
        self._wheels = self._scaled(factors)  # dynamic_reconfigure replaces this object
        self.log_info(
            f"Odometry params : wheel separation {self._wheels.separation:g}, left wheel radius "
            f"{self._wheels.left_radius:g}, right wheel radius {self._wheels.right_radius:g}"
        )
        if 0.0 in self._wheels:
            raise ControllerError("wheel_separation, wheel_radius and their multipliers must not be 0")

        for names in zip(left, right, strict=True):
            self.log_info(
                "Adding left wheel with joint name: {} and right wheel with joint name: {}".format(*names)
            )
        self._left = [hardware.joint(name, Interface.VELOCITY) for name in left]
        self._right = [hardware.joint(name, Interface.VELOCITY) for name in right]
        self.open_topics(context)
        if parameters.flag("publish_cmd", False):
            self._cmd_vel_out = self.open_publisher(f"{context.namespace}/cmd_vel_out", TwistStamped)
        if parameters.flag("publish_wheel_joint_controller_state", False):
            topic = f"{context.namespace}/wheel_joint_controller_state"
            publisher = self.open_publisher(topic, JointTrajectoryControllerState)
            self._wheel_states = _WheelStates(publisher, self._left, self._right)

        self._config = {
            "left_wheel_radius_multiplier": factors.left_radius,
            "right_wheel_radius_multiplier": factors.right_radius,
            "wheel_separation_multiplier": factors.separation,
            "publish_rate": hertz,
            "enable_odom_tf": self.enable_tf,
        }
        server = Server(DiffDriveControllerConfig, self._reconfigure, context.namespace)
        self.opened.callback(close_server, server)

    def create_odometry(self, window: int) -> Odometry:
        """Return the odometry for a base with left and right wheels."""
        return DiffDriveOdometry(window)

    def measure(self, odometry: Odometry, time: int) -> bool:
        """Update the odometry from each side's mean wheel motion; return False if a wheel position is not finite."""
        assert isinstance(odometry, DiffDriveOdometry)
        left = sum(joint.position for joint in self._left) / len(self._left)
        right = sum(joint.position for joint in self._right) / len(self._right)
        if not math.isfinite(left + right):
            return False
        separation, left_radius, right_radius = self._wheels
        odometry.update(
            left,
            right,
            separation=separation,
            left_radius=left_radius,
            right_radius=right_radius,
            time=time,
        )
        return True

    def drive(self, linear: float, angular: float) -> None:
        """Set the velocity commands of the wheels."""
        for joints, velocity in zip((self._left, self._right), self._speeds(linear, angular), strict=True):
            for joint in joints:
                joint.velocity_command = velocity

    def driven(self, time: Time, period: Duration, linear: float, angular: float) -> None:
        """Publish the commanded velocities and the wheel states."""
        if self._cmd_vel_out:
            message = TwistStamped()
            message.header.stamp = time
            message.twist.linear.x = linear
            message.twist.angular.z = angular
            self._cmd_vel_out.publish(message)
        if self._wheel_states:
            self._wheel_states.publish(time, period, self._speeds(linear, angular))

    def _speeds(self, linear: float, angular: float) -> tuple[float, float]:
        """Return the speeds of the left and right wheels in rad/s."""
        separation, left_radius, right_radius = self._wheels
        left = (linear - angular * separation / 2.0) / left_radius
        right = (linear + angular * separation / 2.0) / right_radius
        return (left, right) if math.isfinite(left + right) else (0.0, 0.0)

    def _read_factors(self, parameters: Parameters) -> _Wheels:
        separation = parameters.finite("wheel_separation_multiplier", 1.0)
        self.log_info(f"Wheel separation will be multiplied by {separation:g}.")
        both = parameters.finite("wheel_radius_multiplier", 1.0)
        left = right = both
        if parameters.get("wheel_radius_multiplier") is None:
            left = parameters.finite("left_wheel_radius_multiplier", 1.0)
            right = parameters.finite("right_wheel_radius_multiplier", 1.0)
        self.log_info(f"Left wheel radius will be multiplied by {left:g}.")
        self.log_info(f"Right wheel radius will be multiplied by {right:g}.")
        return _Wheels(separation, left, right)

    def _read_geometry(self, context: ControllerContext, left: str, right: str) -> _Wheels:
        """Return the geometry from the parameters, or from the robot's description if they are not set."""
        parameters = context.parameters
        separation = parameters.finite("wheel_separation", 0.0)
        radius = parameters.finite("wheel_radius", 0.0)
        if not (parameters.has_number("wheel_separation") and parameters.has_number("wheel_radius")):
            robot = read_robot(context, "Robot description couldn't be retrieved from param server.")
            left_joint, right_joint = described_joint(robot, left), described_joint(robot, right)
            if not parameters.has_number("wheel_separation"):
                for side, joint in (("left", left_joint), ("right", right_joint)):
                    log_origin(f"{side} wheel", joint)
                separation = math.dist(left_joint.origin.xyz, right_joint.origin.xyz)
            if not parameters.has_number("wheel_radius"):
                radius = wheel_radius(robot, left_joint, allow_sphere=True)
        return _Wheels(separation, radius, radius)

    def _scaled(self, factors: _Wheels) -> _Wheels:
        return _Wheels(*(value * factor for value, factor in zip(self._described, factors, strict=True)))

    def _reconfigure(self, config: Config, level: int) -> Config:
        is_first = level == ~0  # the server's first call, which passes default values
        if is_first:
            config.update(self._config)
            return config
        factors = _Wheels(
            config.wheel_separation_multiplier,
            config.left_wheel_radius_multiplier,
            config.right_wheel_radius_multiplier,
        )
        if all(map(math.isfinite, (*factors, config.publish_rate))):
            self._wheels = self._scaled(factors)
            self.rate.set(config.publish_rate)
            self.enable_tf = config.enable_odom_tf
            self._config = {name: config[name] for name in self._config}
            self.log_info(_RECONFIGURED.format(**self._config, tf=enabled(config.enable_odom_tf)))
        else:
            config.update(self._config)
        return config


class _WheelStates:
    """Publishes the wheel states, left wheels first."""

    def __init__(
        self,
        publisher: RealtimePublisher[JointTrajectoryControllerState],
        left: Sequence[Joint],
        right: Sequence[Joint],
    ) -> None:
        self._publisher = publisher
        self._joints = [*left, *right]
        self._names = [joint.name for joint in self._joints]
        self._wanted_positions = [0.0] * len(self._joints)
        self._velocities = [0.0] * len(self._joints)  # velocities in the last cycle
        self._wanted_before = (0.0, 0.0)
        self._time: Time | None = None

    def publish(self, time: Time, period: Duration, wanted: tuple[float, float]) -> None:
        """Publish a cycle's wheel states. ``wanted`` holds the commanded velocities of the left and right wheels."""
        joints, wheels = self._joints, len(self._joints) // 2
        dt = period.to_sec()
        elapsed = (time - self._time).to_sec() if self._time else 0.0
        velocities = [joint.velocity for joint in joints]
        accelerations = [
            (now - before) / elapsed if elapsed > 0.0 else math.nan
            for now, before in zip(velocities, self._velocities, strict=True)
        ]
        actual = JointTrajectoryPoint(
            positions=[joint.position for joint in joints],
            velocities=velocities,
            accelerations=accelerations,
            effort=[joint.effort for joint in joints],
        )

        wanted_velocities = [each for each in wanted for _ in range(wheels)]
        self._wanted_positions = [
            position + velocity * dt
            for position, velocity in zip(self._wanted_positions, wanted_velocities, strict=True)
        ]
        # As in ROS, the change in velocity is multiplied, not divided, by the time.
        changes = [(now - before) * dt for now, before in zip(wanted, self._wanted_before, strict=True)]
        desired = JointTrajectoryPoint(
            positions=self._wanted_positions,
            velocities=wanted_velocities,
            accelerations=[each for each in changes for _ in range(wheels)],
            effort=[math.nan] * len(joints),
        )
        error = JointTrajectoryPoint(
            positions=_minus(desired.positions, actual.positions),
            velocities=_minus(desired.velocities, actual.velocities),
            accelerations=_minus(desired.accelerations, actual.accelerations),
            effort=_minus(desired.effort, actual.effort),
        )
        message = JointTrajectoryControllerState(
            joint_names=self._names, desired=desired, actual=actual, error=error
        )
        message.header.stamp = time
        self._publisher.publish(message)
        self._velocities, self._wanted_before, self._time = velocities, wanted, time


def _minus(left: Sequence[float], right: Sequence[float]) -> list[float]:
    return [a - b for a, b in zip(left, right, strict=True)]


def _wheel_names(parameters: Parameters, key: str) -> list[str]:
    """Return the names of one side's wheels. Raise ControllerError if the parameter is missing or invalid."""
    value = parameters.get(key)
    if value is None:
        raise ControllerError(f"Couldn't retrieve wheel param '{key}'.")
    if isinstance(value, str):
        return [value]
    if not isinstance(value, list):
        raise ControllerError(f"Wheel param '{key}' is neither a list of strings nor a string.")
    if not value:
        raise ControllerError(f"Wheel param '{key}' is an empty list")
    for index, name in enumerate(value):
        if not isinstance(name, str):
            raise ControllerError(f"Wheel param '{key}' #{index} isn't a string.")
    return value
