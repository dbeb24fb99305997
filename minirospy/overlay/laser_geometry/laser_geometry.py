"""laser_geometry.laser_geometry, provided by minirospy. Source: http://wiki.ros.org/laser_geometry."""

from minirospy.ros.laser_geometry.laser_geometry.laser_geometry import LaserProjection, PointCloud2

__all__ = ["LaserProjection", "PointCloud2"]
