"""ros_numpy.occupancy_grid, provided by minirospy. Source: http://wiki.ros.org/ros_numpy."""

from minirospy.ros.ros_numpy.ros_numpy.occupancy_grid import numpy_to_occupancy_grid, occupancygrid_to_numpy

__all__ = [
    "numpy_to_occupancy_grid",
    "occupancygrid_to_numpy",
]
