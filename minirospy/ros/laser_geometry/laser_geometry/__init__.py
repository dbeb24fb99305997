"""laser_geometry: converts laser scans to point clouds. Source: http://wiki.ros.org/laser_geometry."""

from typing import TYPE_CHECKING

from minirospy.ros.laser_geometry.laser_geometry.laser_geometry import LaserProjection

if TYPE_CHECKING:
    from minirospy.ros.laser_geometry.laser_geometry import laser_geometry as laser_geometry

__all__ = ["LaserProjection"]
