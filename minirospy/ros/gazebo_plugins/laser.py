"""libgazebo_ros_laser.so and libgazebo_ros_gpu_laser.so: a laser scanner."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import LaserScan

from minirospy.ros.gazebo_plugins.rays import RayPlugin

__all__ = ["Laser"]


class Laser(RayPlugin):
    """Publishes a planar laser scan. Parameters: topicName, frameName."""

    def load(self) -> None:
        """Read the sensor's ray configuration."""
        self.load_rays("/world", LaserScan)

    def sense(self) -> None:
        """Publish a scan."""
        rays = self.rays
        first = len(rays.directions) // rays.count // 2 * rays.count  # the middle row of a multi-row scanner
        directions = rays.directions[first : first + rays.count]
        hits = self.simulation.cast_rays(
            self.sensor_pose, directions, rays.max_range, min_range=rays.min_range
        )
        ranges = rays.noisy(self.simulation, np.asarray(hits.distances))
        scan = LaserScan(header=self.header(self.frame_id))
        scan.angle_min, scan.angle_max = rays.min_angle, rays.max_angle
        scan.angle_increment = (rays.max_angle - rays.min_angle) / max(rays.count - 1, 1)
        scan.range_min, scan.range_max = rays.min_range, rays.max_range
        ranges = np.where(ranges >= rays.max_range, np.inf, ranges)
        scan.ranges = np.where(ranges <= rays.min_range, -np.inf, ranges).tolist()
        scan.intensities = [0.0] * rays.count
        self.publisher.publish(scan)
