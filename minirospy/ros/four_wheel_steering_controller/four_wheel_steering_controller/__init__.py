"""A controller that is not supported. Loading it fails with an error that says so.

Source: http://wiki.ros.org/four_wheel_steering_controller.
"""

from minirospy.core.control.controller import Controller, ControllerContext, ControllerError, Resources

__all__ = ["FourWheelSteeringController"]


class FourWheelSteeringController(Controller):
    """Reports that four wheel steering is not supported."""

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Raise ControllerError, listing the missing features."""
        raise ControllerError(
            f"controller '{context.name}': minirospy has no four wheel steering (its odometry, and four_wheel_steering_msgs "
            "for the topic cmd_four_wheel_steering), so front_wheel, rear_wheel, front_steering and rear_steering have no "
            "effect; ackermann_steering_controller steers the front axle, diff_drive_controller drives without steering"
        )
