"""ros_numpy.occupancy_grid: converts maps to masked arrays (height, width), and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from nav_msgs.msg import MapMetaData, OccupancyGrid

from minirospy.ros.ros_numpy.ros_numpy.registry import converts_from_numpy, converts_to_numpy

if TYPE_CHECKING:
    from minirospy.ros.ros_numpy.ros_numpy.registry import Array

__all__ = ["numpy_to_occupancy_grid", "occupancygrid_to_numpy"]


@converts_to_numpy(OccupancyGrid)
def occupancygrid_to_numpy(msg: OccupancyGrid) -> np.ma.MaskedArray[tuple[int, int], np.dtype[np.int8]]:
    """Convert a map to an array with unknown cells (-1) masked. Raise ValueError if the map has too little data."""
    data = np.asarray(msg.data, dtype=np.int8).reshape(msg.info.height, msg.info.width)
    return np.ma.MaskedArray(data, mask=data == -1, fill_value=-1)


@converts_from_numpy(OccupancyGrid)
def numpy_to_occupancy_grid(arr: Array, info: MapMetaData | None = None) -> OccupancyGrid:
    """Convert an int8 array to a map; masked cells become unknown. Raise TypeError if the array is not 2D and int8."""
    if arr.ndim != 2:
        raise TypeError("Array must be 2D")
    if arr.dtype != np.int8:
        raise TypeError("Array must be of int8s")
    grid = OccupancyGrid(info=info or MapMetaData())
    grid.data = np.ma.filled(arr, -1).ravel().tolist()
    grid.info.height, grid.info.width = arr.shape
    return grid
