"""libgazebo_ros_block_laser.so: publishes the points of a multi-row scanner."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point32
from sensor_msgs.msg import ChannelFloat32, PointCloud

from minirospy.ros.gazebo_plugins.rays import RayPlugin

__all__ = ["BlockLaser"]


class BlockLaser(RayPlugin):
    """libgazebo_ros_block_laser.so. Parameters: topicName, frameName, gaussianNoise (applied to coordinates and intensity)."""

    def load(self) -> None:
        """Read the sensor's ray configuration."""
        self.load_rays("/world", PointCloud)
        self._noise = self.number("gaussianNoise", 0.0)

    def sense(self) -> None:
        """Publish the points in the sensor's frame. A ray that hits nothing gives a point at the maximum range."""
        rays, random = self.rays, self.simulation.random
        measured = rays.noisy(self.simulation, rays.cast(self.simulation, self.sensor_pose))
        ranges = np.minimum(measured, rays.max_range)
        points = rays.directions * ranges[:, None]
        intensities = np.zeros(len(ranges))
        if self._noise > 0:
            is_hit = (ranges < rays.max_range)[:, None]
            points = points + is_hit * random.normal(0.0, self._noise, points.shape)
            intensities = random.normal(0.0, self._noise, len(ranges))
        cloud = PointCloud(header=self.header(self.frame_id))
        cloud.points = [Point32(*each) for each in points.tolist()]
        cloud.channels = [ChannelFloat32(values=intensities.tolist())]
        self.publisher.publish(cloud)
