"""libgazebo_ros_range.so: a sonar or infrared sensor, which reports the shortest distance that its rays measure."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import Range as RangeMsg

from minirospy.ros.gazebo_plugins.rays import RayPlugin

__all__ = ["Range"]


class Range(RayPlugin):
    """The plugin. Parameters: topicName, frameName, radiation, fov, gaussianNoise, updateRate."""

    def load(self) -> None:
        """Read the sensor's rays."""
        self.load_rays("/range", RangeMsg)
        self._noise = self.number("gaussianNoise", 0.0)
        self._fov = self.number("fov", 0.05)
        is_infrared = self.text("radiation", "ultrasound") == "infrared"
        self._kind = RangeMsg.INFRARED if is_infrared else RangeMsg.ULTRASOUND
        self.rate = self.number("updateRate", 0.0) or self.rate

    def sense(self) -> None:
        """Publish the shortest distance."""
        rays = self.rays
        nearest = float(min(np.min(rays.cast(self.simulation, self.sensor_pose)), rays.max_range))
        if self._noise > 0 and nearest < rays.max_range:
            nearest += float(self.simulation.random.normal(0.0, self._noise))
        message = RangeMsg(radiation_type=self._kind, field_of_view=self._fov)
        message.header.stamp = self.now
        message.header.frame_id = self.frame_id
        message.min_range, message.max_range = rays.min_range, rays.max_range
        message.range = min(max(nearest, rays.min_range), rays.max_range)
        self.publisher.publish(message)
