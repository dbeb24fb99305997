"""The controller that publishes inertial sensors: ``from imu_sensor_controller import ImuSensorController``.

Source: http://wiki.ros.org/imu_sensor_controller.
"""

from __future__ import annotations

from collections.abc import Sequence

from geometry_msgs.msg import Quaternion, Vector3
from sensor_msgs.msg import Imu

from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, Resources
from minirospy.core.control.hardware import ImuSensor, Interface
from minirospy.core.control.rates import PublishRate
from minirospy.ros.realtime_tools.realtime_tools import RealtimePublisher

__all__ = ["ImuSensorController"]

_UNKNOWN = [0.0] * 9
_NOT_MEASURED = [-1.0, *_UNKNOWN[1:]]


class ImuSensorController(Controller):
    """Publishes each IMU sensor on a topic with the sensor's name."""

    interfaces = (Interface.IMU,)

    def __init__(self) -> None:
        self._topics: list[tuple[ImuSensor, RealtimePublisher[Imu]]] = []

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Create a publisher for each sensor. Raise ControllerError if ``publish_rate`` is not set."""
        self._rate = PublishRate.read(context.parameters)
        for name in hardware.names(Interface.IMU):
            publisher = RealtimePublisher(f"{context.root.rstrip('/')}/{name}", Imu, queue_size=4)
            self.opened.callback(publisher.close)
            self._topics.append((hardware.imu(name), publisher))

    def starting(self, time: Time) -> None:
        """Schedule the first message one period from now."""
        self._rate.start(time)

    def update(self, time: Time, period: Duration) -> None:
        """Publish the sensors' measurements."""
        if self._rate.is_due(time):
            for sensor, publisher in self._topics:
                publisher.publish(_message(sensor, time))


def _message(sensor: ImuSensor, time: Time) -> Imu:
    message = Imu()
    message.header.stamp = time
    message.header.frame_id = sensor.frame_id
    if sensor.orientation is not None:
        message.orientation = Quaternion(*sensor.orientation)
    if sensor.angular_velocity is not None:
        message.angular_velocity = Vector3(*sensor.angular_velocity)
    if sensor.linear_acceleration is not None:
        message.linear_acceleration = Vector3(*sensor.linear_acceleration)
    message.orientation_covariance = _covariance(sensor.orientation, sensor.orientation_covariance)
    message.angular_velocity_covariance = _covariance(
        sensor.angular_velocity, sensor.angular_velocity_covariance
    )
    message.linear_acceleration_covariance = _covariance(
        sensor.linear_acceleration, sensor.linear_acceleration_covariance
    )
    return message


def _covariance(measured: Sequence[float] | None, covariance: Sequence[float] | None) -> list[float]:
    """Return a covariance in the form of an Imu message, in which -1 means not measured, and 0 unknown."""
    if covariance is not None:
        return list(covariance)
    return _NOT_MEASURED if measured is None else _UNKNOWN
