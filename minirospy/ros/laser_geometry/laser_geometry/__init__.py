"""laser_geometry: clouds of points from laser scans. Source: http://wiki.ros.org/laser_geometry."""

from minirospy.ros.laser_geometry.laser_geometry.laser_geometry import LaserProjection

__all__ = ["LaserProjection"]
