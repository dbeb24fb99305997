"""The controller that publishes forces and torques: ``from force_torque_sensor_controller import ForceTorqueSensorController``.

Source: http://wiki.ros.org/force_torque_sensor_controller.
"""

from __future__ import annotations

from geometry_msgs.msg import Vector3, WrenchStamped

from minirospy.base.times import Duration, Time
from minirospy.core.control.controller import Controller, ControllerContext, Resources
from minirospy.core.control.hardware import ForceTorqueSensor, Interface
from minirospy.core.control.rates import PublishRate
from minirospy.ros.realtime_tools.realtime_tools import RealtimePublisher

__all__ = ["ForceTorqueSensorController"]


class ForceTorqueSensorController(Controller):
    """Publishes each force-torque sensor on a topic with the sensor's name."""

    interfaces = (Interface.FORCE_TORQUE,)

    def __init__(self) -> None:
        self._topics: list[tuple[ForceTorqueSensor, RealtimePublisher[WrenchStamped]]] = []

    def init(self, hardware: Resources, context: ControllerContext) -> None:
        """Create a publisher for each sensor. Raise ControllerError if ``publish_rate`` is not set."""
        self._rate = PublishRate.read(context.parameters)
        for name in hardware.names(Interface.FORCE_TORQUE):
            topic = f"{context.root.rstrip('/')}/{name}"
            publisher = RealtimePublisher(topic, WrenchStamped, queue_size=4)
            self.opened.callback(publisher.close)
            self._topics.append((hardware.force_torque_sensor(name), publisher))

    def starting(self, time: Time) -> None:
        """Schedule the first message one period from now."""
        self._rate.start(time)

    def update(self, time: Time, period: Duration) -> None:
        """Publish the sensors' measurements."""
        if self._rate.is_due(time):
            for sensor, publisher in self._topics:
                message = WrenchStamped()
                message.header.stamp = time
                message.header.frame_id = sensor.frame_id
                message.wrench.force = Vector3(*sensor.force)
                message.wrench.torque = Vector3(*sensor.torque)
                publisher.publish(message)
