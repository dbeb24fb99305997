"""laser_geometry: converts laser scans to point clouds. Source: http://wiki.ros.org/laser_geometry."""

from minirospy.ros.laser_geometry.laser_geometry.laser_geometry import LaserProjection

__all__ = ["LaserProjection"]
