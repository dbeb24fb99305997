"""libgazebo_ros_block_laser.so: the points of a scanner with several rows."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point32
from sensor_msgs.msg import ChannelFloat32, PointCloud

from minirospy.ros.gazebo_plugins.rays import read_rays
from minirospy.ros.gazebo_ros.plugins import SensorPlugin

__all__ = ["BlockLaser"]


class BlockLaser(SensorPlugin):
    """The plugin. Parameters: topicName, frameName, gaussianNoise (of the coordinates and the intensity)."""

    def load(self) -> None:
        """Read the sensor's rays."""
        self.shown_rays = self._rays = read_rays(self.sensor)
        self._frame = self.frame("frameName", "/world")
        self._noise = self.number("gaussianNoise", 0.0)
        self._publisher = self.publish_to(self.text("topicName", "/world"), PointCloud)

    def is_needed(self) -> bool:
        """Return whether there is a subscriber."""
        return self._publisher.get_num_connections() > 0

    def sense(self) -> None:
        """Publish the points in the sensor's frame; a ray that hits nothing has its point at the range's end."""
        rays, random = self._rays, self.simulation.random
        hits = self.simulation.cast_rays(
            self.sensor_pose, rays.directions, rays.max_range, min_range=rays.min_range
        )
        ranges = np.minimum(rays.noisy(self.simulation, np.asarray(hits.distances)), rays.max_range)
        points = rays.directions * ranges[:, None]
        intensities = np.zeros(len(ranges))
        if self._noise > 0:
            is_hit = (ranges < rays.max_range)[:, None]
            points = points + is_hit * random.normal(0.0, self._noise, points.shape)
            intensities = random.normal(0.0, self._noise, len(ranges))
        cloud = PointCloud()
        cloud.header.stamp = self.now
        cloud.header.frame_id = self._frame
        cloud.points = [Point32(*each) for each in points.tolist()]
        cloud.channels = [ChannelFloat32(values=intensities.tolist())]
        self._publisher.publish(cloud)
