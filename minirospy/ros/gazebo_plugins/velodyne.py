"""libgazebo_ros_velodyne_laser.so and libgazebo_ros_velodyne_gpu_laser.so: publish the points of a multi-row scanner.

The layout, order and filters of the points match velodyne_simulator 1.0.12 (https://bitbucket.org/DataspeedInc).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from minirospy.ros.gazebo_plugins.rays import RayPlugin

__all__ = ["Velodyne"]

_FIELDS = {"x": "<f4", "y": "<f4", "z": "<f4", "intensity": "<f4", "ring": "<u2", "time": "<f4"}
_KINDS = {"<f4": PointField.FLOAT32, "<u2": PointField.UINT16}
_POINT = np.dtype(list(_FIELDS.items()))


class Velodyne(RayPlugin):
    """Publishes a multi-row scanner's point cloud.

    Parameters: topicName, frameName, organize_cloud, min_range, max_range, min_intensity, gaussianNoise (of ranges, in m).
    """

    def load(self) -> None:
        """Read the sensor's ray configuration."""
        self.load_rays("/points", PointCloud2)
        rays = self.rays
        if self.namespace and not self.text("frameName", "/world").startswith("/"):
            self.frame_id = f"{self.namespace.strip('/')}/{self.frame_id}"
        self._is_organized = self.flag("organize_cloud", False)
        self._nearest = max(self.number("min_range", 0.0), rays.min_range)
        self._farthest = min(self.number("max_range", math.inf), rays.max_range)
        # All intensities are 0, so a positive minimum removes all points.
        self._has_points = self._is_organized or self.number("min_intensity", 0.0) <= 0
        self._noise = self.number("gaussianNoise", 0.0)

    def sense(self) -> None:
        """Publish the points in the sensor's frame, column by column: all rows of one direction, then the next."""
        rays, random = self.rays, self.simulation.random
        ranges = rays.noisy(self.simulation, rays.cast(self.simulation, self.sensor_pose))
        is_valid = self._is_between(ranges)
        if self._noise > 0:
            ranges = ranges + random.normal(0.0, self._noise, len(ranges))
            is_valid = self._is_between(ranges) & (self._is_organized | is_valid)
        points = np.zeros(len(ranges), _POINT)
        with np.errstate(invalid="ignore"):  # an axis-aligned ray that hits nothing yields 0 * inf
            for index, axis in enumerate("xyz"):
                points[axis] = rays.directions[:, index] * ranges
        points["ring"] = np.arange(len(ranges)) // rays.count
        rows = len(ranges) // rays.count
        points, is_valid = (each.reshape(rows, rays.count).T.ravel() for each in (points, is_valid))

        cloud = PointCloud2(header=self.header(self.frame_id), height=1, point_step=_POINT.itemsize)
        cloud.is_dense = not self._is_organized
        offset = 0
        for name, kind in _FIELDS.items():
            cloud.fields.append(PointField(name, offset, _KINDS[kind], 1))
            offset += np.dtype(kind).itemsize
        if self._is_organized:
            for name in ("x", "y", "z", "intensity"):
                points[name][~is_valid] = np.nan
            cloud.height, cloud.width = rays.count, rows
        else:
            points = points[is_valid & self._has_points]
            cloud.width = len(points)
        cloud.row_step = cloud.point_step * cloud.width
        cloud.data = points.tobytes()
        self.publisher.publish(cloud)

    def _is_between(self, ranges: NDArray[np.float64]) -> NDArray[np.bool_]:
        return (self._nearest < ranges) & (ranges < self._farthest)
