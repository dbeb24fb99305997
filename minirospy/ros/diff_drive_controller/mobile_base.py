"""The common part of wheeled bases' controllers: velocity commands, their timeout and limits, odometry and its topics.

Source: http://wiki.ros.org/diff_drive_controller, http://wiki.ros.org/ackermann_steering_controller.
"""

from __future__ import annotations

import math
from contextlib import closing
from typing import NamedTuple, TypeVar

from geometry_msgs.msg import Quaternion, TransformStamped, Twist, Vector3
from nav_msgs.msg import Odometry as OdometryMessage
from tf.msg import tfMessage

from minirospy import client as rospy
from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, ControllerError
from minirospy.core.control.odometry import Odometry
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.rates import PublishRate, nanoseconds
from minirospy.core.control.speed_limiter import SpeedLimiter
from minirospy.core.idl.protocols import Message
from minirospy.core.urdf.model import Cylinder, Joint, Robot, Sphere
from minirospy.ros.realtime_tools.realtime_tools import RealtimePublisher

__all__ = ["MobileBase", "described_joint", "enabled", "log_origin", "read_robot", "wheel_radius"]

_M = TypeVar("_M", bound=Message)


class _Command(NamedTuple):
    """A velocity command, with its arrival in ROS time (nanoseconds)."""

    linear: float  # m/s
    angular: float  # rad/s
    stamp: int


_STOP = _Command(0.0, 0.0, 0)


class MobileBase(Controller):
    """Follows ``cmd_vel``, and publishes ``odom`` and its transform. Subclasses handle the wheels.

    The base decelerates to a stop, within its limits, if no command arrives for ``cmd_vel_timeout``, or if a wheel position is
    NaN.
    """

    def __init__(self) -> None:
        self._command = _STOP  # the cmd_vel callback replaces this object
        self._last = (0.0, 0.0)  # the last cycle's linear and angular velocity
        self._before_last = (0.0, 0.0)
        self._now = 0  # the last cycle's time in ns
        self._is_running = False

    def measure(self, odometry: Odometry, time: int) -> bool:
        """Update the odometry from the motion of the wheels; return False, without changes, if a wheel position is NaN."""
        raise NotImplementedError

    def drive(self, linear: float, angular: float) -> None:
        """Command the wheels."""
        raise NotImplementedError

    def create_odometry(self, window: int) -> Odometry:
        """Return the odometry, starting at the origin."""
        raise NotImplementedError

    def read_rate(self, context: ControllerContext) -> float:
        """Read, log and return the odometry's publish rate. As in ROS, it is the first parameter in the log."""
        self._name = context.name
        hertz = context.parameters.finite("publish_rate", 50.0)
        self.log_info(f"Controller state will be published at {hertz:g}Hz.")
        self.rate = PublishRate(hertz)
        return hertz

    def read_parameters(self, context: ControllerContext) -> None:
        """Read the parameters common to all bases. Raise ControllerError or ValueError if one is invalid."""
        parameters = context.parameters
        self._open_loop = parameters.flag("open_loop", False)
        window = parameters.integer("velocity_rolling_window_size", 10)
        self.log_info(f"Velocity rolling window size of {window}.")
        self._odometry = self.create_odometry(window)

        self._timeout = parameters.finite("cmd_vel_timeout", 0.5)
        self.log_info(f"Velocity commands will be considered old if they are older than {self._timeout:g}s.")
        self._allow_multiple = parameters.flag("allow_multiple_cmd_vel_publishers", True)
        self.log_info(f"Allow mutiple cmd_vel publishers is {enabled(self._allow_multiple)}")
        self._base_frame = parameters.text("base_frame_id", "base_link")
        self.log_info(f"Base frame_id set to {self._base_frame}")
        self._odom_frame = parameters.text("odom_frame_id", "odom")
        self.log_info(f"Odometry frame_id set to {self._odom_frame}")
        self.enable_tf = parameters.flag("enable_odom_tf", True)
        self.log_info(f"Publishing to tf is {enabled(self.enable_tf)}")

        self._linear_limits = SpeedLimiter.read(parameters.below("linear/x"))
        self._angular_limits = SpeedLimiter.read(parameters.below("angular/z"))

    def open_topics(self, context: ControllerContext) -> None:
        """Publish ``odom`` and ``/tf``, subscribe to ``cmd_vel``. Raise ControllerError if a covariance parameter is missing."""
        self._pose_covariance = _covariance(context.parameters, "pose_covariance_diagonal")
        self._twist_covariance = _covariance(context.parameters, "twist_covariance_diagonal")
        self._odom = self.open_publisher(f"{context.namespace}/odom", OdometryMessage)
        self._tf = self.open_publisher("/tf", tfMessage)
        self._subscriber = rospy.Subscriber(
            f"{context.namespace}/cmd_vel", Twist, self._receive, queue_size=1
        )
        self.opened.callback(self._subscriber.unregister)

    def open_publisher(self, topic: str, message_class: type[_M]) -> RealtimePublisher[_M]:
        """Create a publisher; closing the controller closes it."""
        return self.opened.enter_context(closing(RealtimePublisher(topic, message_class, queue_size=100)))

    def starting(self, time: Time) -> None:
        """Stop the wheels; the odometry continues from its current pose."""
        self._command = _STOP
        self._last = self._before_last = (0.0, 0.0)
        self._now = nanoseconds(time)
        self.drive(0.0, 0.0)
        self.rate.start(time)
        self._odometry.start(self._now)
        self._is_running = True

    def stopping(self, time: Time) -> None:
        """Stop the wheels."""
        self._is_running = False
        self.drive(0.0, 0.0)

    def update(self, time: Time, period: Duration) -> None:
        """Update and publish the odometry, then command the wheels."""
        now = nanoseconds(time)
        if now < self._now:
            self._command = _STOP  # the clock jumped back, so the command would time out too late
        self._now = now
        is_measured = True
        if self._open_loop:
            self._odometry.move_open_loop(*self._last, now)
        else:
            is_measured = self.measure(self._odometry, now)
        if is_measured and self.rate.is_due(time):
            self._publish(time)

        linear, angular, stamp = self._command
        if not is_measured or (now - stamp) * 1e-9 > self._timeout:
            linear = angular = 0.0
        dt = period.to_sec()
        last, before_last = self._last, self._before_last
        linear = self._linear_limits.limit(linear, last[0], before_last[0], dt)
        angular = self._angular_limits.limit(angular, last[1], before_last[1], dt)
        self._before_last = last
        self._last = (linear, angular)
        self.drive(linear, angular)
        self.driven(time, period, linear, angular)

    def driven(self, time: Time, period: Duration, linear: float, angular: float) -> None:
        """Publish the commanded velocities; the default does nothing."""

    def log_info(self, text: str) -> None:
        """Log a line under the controller's name."""
        rospy.loginfo("%s", text, logger_name=self._name)

    def _receive(self, twist: Twist) -> None:
        if not self._is_running:
            rospy.logerr("Can't accept new commands. Controller is not running.", logger_name=self._name)
            return
        publishers = self._subscriber.get_num_connections()
        if not self._allow_multiple and publishers > 1:
            rospy.logerr_throttle(
                1.0,
                f"Detected {publishers} publishers. Only 1 publisher is allowed. Going to brake.",
                logger_name=self._name,
            )
            self._command = _STOP
            return
        linear, angular = twist.linear.x, twist.angular.z
        if not (math.isfinite(linear) and math.isfinite(angular)):
            rospy.logwarn_throttle(1.0, "Received NaN in velocity command. Ignoring.")
            return
        self._command = _Command(linear, angular, nanoseconds(rospy.Time.now()))

    def _publish(self, time: Time) -> None:
        odometry = self._odometry
        orientation = Quaternion(0.0, 0.0, math.sin(odometry.heading / 2.0), math.cos(odometry.heading / 2.0))
        message = OdometryMessage()
        message.header.stamp = time
        message.header.frame_id = self._odom_frame
        message.child_frame_id = self._base_frame
        message.pose.pose.position.x = odometry.x
        message.pose.pose.position.y = odometry.y
        message.pose.pose.orientation = orientation
        message.pose.covariance = self._pose_covariance
        message.twist.twist.linear.x = odometry.linear
        message.twist.twist.angular.z = odometry.angular
        message.twist.covariance = self._twist_covariance
        self._odom.publish(message)
        if self.enable_tf:
            transform = TransformStamped()
            transform.header.stamp = time
            transform.header.frame_id = self._odom_frame
            transform.child_frame_id = self._base_frame
            transform.transform.translation = Vector3(odometry.x, odometry.y, 0.0)
            transform.transform.rotation = orientation
            self._tf.publish(tfMessage([transform]))


def enabled(flag: bool) -> str:
    """Return the word that ROS logs for a flag: "enabled" or "disabled"."""
    return "enabled" if flag else "disabled"


def _covariance(parameters: Parameters, key: str) -> list[float]:
    """Return the covariance matrix whose diagonal is a parameter's list of six numbers. ROS aborts the process without them."""
    diagonal = parameters.numbers(key)
    if diagonal is None or len(diagonal) != 6:
        raise ControllerError(f"Parameter '{parameters.namespace}/{key}' must be a list of 6 numbers")
    return [diagonal[row] if row == column else 0.0 for row in range(6) for column in range(6)]


def read_robot(context: ControllerContext, text: str) -> Robot:
    """Return the robot's description. If there is none, log the reason and raise ControllerError with ``text``."""
    try:
        return context.robot()
    except ControllerError as error:
        rospy.logerr("%s", error)
        raise ControllerError(text) from error


def described_joint(robot: Robot, name: str) -> Joint:
    """Return a joint from the robot description. Raise ControllerError if the joint is missing."""
    joint = robot.joints.get(name)
    if joint is None:
        raise ControllerError(f"{name} couldn't be retrieved from model description")
    return joint


def log_origin(name: str, joint: Joint) -> None:
    """Log a joint's position in its parent's frame, in ROS's format."""
    x, y, z = joint.origin.xyz
    rospy.loginfo("%s to origin: %g,%g, %g", name, x, y, z)


def wheel_radius(robot: Robot, joint: Joint, *, allow_sphere: bool) -> float:
    """Return the radius of the wheel that a joint drives: that of its collision geometry, a cylinder or a sphere.

    If there is none, log the reason and raise ControllerError.
    """
    link = robot.links[joint.child]
    if not link.collisions:
        rospy.logerr(
            "Link %s does not have collision description. Add collision description for link to urdf.",
            link.name,
        )
    else:
        geometry = link.collisions[0].geometry
        if isinstance(geometry, Cylinder) or (allow_sphere and isinstance(geometry, Sphere)):
            return geometry.radius
    kinds = "a cylinder or sphere" if allow_sphere else "a cylinder"
    rospy.logerr("Wheel link %s is NOT modeled as %s!", link.name, kinds)
    raise ControllerError(f"Couldn't retrieve {joint.name} wheel radius")
