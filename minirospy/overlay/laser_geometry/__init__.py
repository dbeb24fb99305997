"""laser_geometry, provided by minirospy: clouds of laser scans. Source: http://wiki.ros.org/laser_geometry."""

from laser_geometry import laser_geometry as laser_geometry
from minirospy.ros.laser_geometry.laser_geometry import LaserProjection

__all__ = ["LaserProjection"]
