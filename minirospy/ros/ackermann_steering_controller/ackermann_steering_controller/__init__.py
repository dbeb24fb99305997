"""The controller for a base with Ackermann steering: ``from ackermann_steering_controller import AckermannSteeringController``.

Source: http://wiki.ros.org/ackermann_steering_controller.
"""

from __future__ import annotations

import math

from minirospy import client as rospy
from minirospy.core.control.controller import ControllerContext, ControllerError, Resources
from minirospy.core.control.hardware import Interface
from minirospy.core.control.odometry import AckermannOdometry, Odometry
from minirospy.ros.diff_drive_controller.mobile_base import (
    MobileBase,
    described_joint,
    log_origin,
    read_robot,
    wheel_radius,
)

__all__ = ["AckermannSteeringController"]


class AckermannSteeringController(MobileBase):
    """Drives ``rear_wheel`` and steers ``front_steer``. As in ROS, the steering angle is ``angular.z`` of ``cmd_vel``."""

    interfaces = (Interface.POSITION, Interface.VELOCITY)

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Read the parameters, claim the joints and create the publishers and subscriber."""
        parameters = context.parameters
        rear = parameters.text("rear_wheel", "rear_wheel_joint")
        front = parameters.text("front_steer", "front_steer_joint")
        self.read_rate(context)
        wheelbase_factor = parameters.finite("wheel_separation_h_multiplier", 1.0)
        self.log_info(f"Wheel separation height will be multiplied by {wheelbase_factor:g}.")
        radius_factor = parameters.finite("wheel_radius_multiplier", 1.0)
        self.log_info(f"Wheel radius will be multiplied by {radius_factor:g}.")
        self._steering_factor = parameters.finite("steer_pos_multiplier", 1.0)
        self.log_info(f"Steer pos will be multiplied by {self._steering_factor:g}.")
        self.read_parameters(context)

        wheelbase, self._radius = self._read_geometry(context, rear, front)
        self._wheelbase = wheelbase_factor * wheelbase
        self._odometry_radius = radius_factor * self._radius
        self.log_info(
            f"Odometry params : wheel separation height {self._wheelbase:g}, wheel radius {self._odometry_radius:g}"
        )
        if 0.0 in (self._wheelbase, self._odometry_radius):
            raise ControllerError("wheel_separation_h, wheel_radius and their multipliers must not be 0")
        self.log_info(f"Adding the rear wheel with joint name: {rear}")
        self._rear = hardware.joint(rear, Interface.VELOCITY)
        self.log_info(f"Adding the front steer with joint name: {front}")
        self._front = hardware.joint(front, Interface.POSITION)
        self.log_info("Adding the subscriber: cmd_vel")
        self.open_topics(context)
        self.log_info("Finished controller initialization")

    def create_odometry(self, window: int) -> Odometry:
        """Return the odometry for a steered base."""
        return AckermannOdometry(window)

    def measure(self, odometry: Odometry, time: int) -> bool:
        """Update the odometry from the rear wheel's motion; return False if a joint position is not finite."""
        assert isinstance(odometry, AckermannOdometry)
        wheel, steering = self._rear.position, self._front.position * self._steering_factor
        if not (math.isfinite(wheel) and math.isfinite(steering)):
            return False
        odometry.update(wheel, steering, wheelbase=self._wheelbase, radius=self._odometry_radius, time=time)
        return True

    def drive(self, linear: float, angular: float) -> None:
        """Set the wheel's velocity and the steering angle. As in ROS, the radius multiplier does not affect the velocity."""
        velocity = linear / self._radius
        self._rear.velocity_command = velocity if math.isfinite(velocity) else 0.0
        self._front.position_command = angular

    def _read_geometry(self, context: ControllerContext, rear: str, front: str) -> tuple[float, float]:
        """Return the wheelbase and the radius from the parameters, or from the robot's description if they are not set."""
        parameters = context.parameters
        wheelbase = parameters.finite("wheel_separation_h", 0.0)
        radius = parameters.finite("wheel_radius", 0.0)
        if not (parameters.has_number("wheel_separation_h") and parameters.has_number("wheel_radius")):
            # The typo "descripion" is ROS's.
            robot = read_robot(context, "Robot descripion couldn't be retrieved from param server.")
            rear_joint = described_joint(robot, rear)
            if not parameters.has_number("wheel_separation_h"):
                front_joint = described_joint(robot, front)
                log_origin("rear wheel", rear_joint)
                log_origin("front steer", front_joint)
                wheelbase = abs(rear_joint.origin.xyz[0] - front_joint.origin.xyz[0])
                rospy.loginfo("Calculated wheel_separation_h: %g", wheelbase)
            if not parameters.has_number("wheel_radius"):
                radius = wheel_radius(robot, rear_joint, allow_sphere=False)
                rospy.loginfo("Retrieved wheel_radius: %g", radius)
        return wheelbase, radius
