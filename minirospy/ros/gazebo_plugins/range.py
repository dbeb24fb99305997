"""libgazebo_ros_range.so: a sonar or infrared sensor, which reports the shortest distance that its rays measure."""

from __future__ import annotations

from sensor_msgs.msg import Range as RangeMsg

from minirospy.ros.gazebo_plugins.rays import RayPlugin

__all__ = ["Range"]


class Range(RayPlugin):
    """Measures the shortest distance. Parameters: topicName, frameName, radiation, fov, gaussianNoise, updateRate."""

    def load(self) -> None:
        """Read the sensor's ray configuration."""
        self.load_rays("/range", RangeMsg)
        self._noise = self.number("gaussianNoise", 0.0)
        self._fov = self.number("fov", 0.05)
        is_infrared = self.text("radiation", "ultrasound") == "infrared"
        self._kind = RangeMsg.INFRARED if is_infrared else RangeMsg.ULTRASOUND
        self.rate = self.number("updateRate", 0.0) or self.rate

    def sense(self) -> None:
        """Publish the shortest distance."""
        rays = self.rays
        nearest = self.nearest()
        if nearest < rays.max_range:
            (nearest,) = self.noisy([nearest], self._noise)
        nearest = min(max(nearest, rays.min_range), rays.max_range)
        header, limits = self.header(self.frame_id), (rays.min_range, rays.max_range)
        self.publisher.publish(RangeMsg(header, self._kind, self._fov, *limits, nearest))
