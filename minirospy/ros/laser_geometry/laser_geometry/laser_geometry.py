"""laser_geometry.laser_geometry: LaserProjection, in numpy. Its clouds are byte-identical to those from ROS's Python module.

Source: http://wiki.ros.org/laser_geometry.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeAlias

from sensor_msgs.msg import PointCloud2, PointField

if TYPE_CHECKING:
    from collections.abc import Sequence

    import genpy
    import numpy
    from geometry_msgs.msg import TransformStamped
    from numpy.typing import NDArray
    from sensor_msgs.msg import LaserScan

    from minirospy.ros.tf2_ros.tf2_ros.interface import BufferInterface

    Values: TypeAlias = NDArray[Any]

__all__ = ["LaserProjection", "PointCloud2"]

_VIEWPOINT = ("vp_x", "vp_y", "vp_z")
_INT32, _FLOAT32 = 5, 7  # PointField's numbers for these types


class LaserProjection:
    """Converts laser scans to point clouds. Caches the beams' directions for the next scan."""

    LASER_SCAN_INVALID = -1.0
    LASER_SCAN_MIN_RANGE = -2.0
    LASER_SCAN_MAX_RANGE = -3.0

    class ChannelOption:
        """Bits that select a point cloud's fields besides x, y and z."""

        NONE = 0x00
        INTENSITY = 0x01
        INDEX = 0x02
        DISTANCE = 0x04
        TIMESTAMP = 0x08
        VIEWPOINT = 0x10
        DEFAULT = INTENSITY | INDEX

    def __init__(self) -> None:
        self._beams: tuple[float, float, int] | None = None
        self._directions: Values | None = None

    def projectLaser(
        self,
        scan_in: LaserScan,
        range_cutoff: float = -1.0,
        channel_options: int = ChannelOption.DEFAULT,
    ) -> PointCloud2:
        """Convert a scan to a point cloud in the scan's frame. Omit ranges outside the scan's limits.

        ``range_cutoff``: omit ranges from this distance in meters; if negative, only the scan's limit applies.
        ``channel_options``: the fields, from ``ChannelOption``; ``INTENSITY`` is ignored if the scan has no intensities.
        Raise IndexError if the scan has fewer intensities than ranges.
        """
        import numpy as np

        ranges = np.asarray(scan_in.ranges, np.float64)
        limit = scan_in.range_max if range_cutoff < 0 else min(range_cutoff, scan_in.range_max)
        if math.isnan(range_cutoff):
            limit = math.nan
        chosen = np.flatnonzero((ranges < limit) & (ranges >= scan_in.range_min))
        distances = ranges[chosen]

        columns: list[tuple[str, int, Values | int]] = [
            (name, _FLOAT32, axis * distances)
            for name, axis in zip("xy", self._directions_of(scan_in, len(ranges))[:, chosen], strict=True)
        ]
        columns.append(("z", _FLOAT32, 0))
        option = self.ChannelOption
        if channel_options & option.INTENSITY and len(scan_in.intensities):
            if len(scan_in.intensities) < len(ranges):
                raise IndexError(
                    f"the scan has {len(ranges)} ranges and {len(scan_in.intensities)} intensities"
                )
            columns.append(("intensity", _FLOAT32, np.asarray(scan_in.intensities, np.float64)[chosen]))
        if channel_options & option.INDEX:
            columns.append(("index", _INT32, chosen))
        if channel_options & option.DISTANCE:
            columns.append(("distances", _FLOAT32, distances))
        if channel_options & option.TIMESTAMP:
            columns.append(("stamps", _FLOAT32, chosen * scan_in.time_increment))
        if channel_options & option.VIEWPOINT:
            columns += [(name, _FLOAT32, 0) for name in _VIEWPOINT]
        return _cloud(scan_in, columns, len(chosen))

    def transformLaserScanToPointCloud(
        self,
        target_frame: str,
        scan_in: LaserScan,
        tf_buffer: BufferInterface,
        range_cutoff: float = -1.0,
        channel_options: int = ChannelOption.DEFAULT,
    ) -> PointCloud2:
        """Convert a scan to a point cloud in another frame.

        Each point is transformed by the laser's pose at the time when the point was measured.

        As in the C++ class, the transforms for the first and last beam come from a tf2 buffer; those in between are
        interpolated. ROS's Python module lacks this method. If there is no transform, raise the same exception as
        ``lookup_transform``.
        """
        import numpy as np

        duration = max(0, len(scan_in.ranges) - 1) * scan_in.time_increment
        first, last = (
            tf_buffer.lookup_transform(target_frame, scan_in.header.frame_id, stamp)
            for stamp in (scan_in.header.stamp, _later(scan_in.header.stamp, duration))
        )
        needed = channel_options | self.ChannelOption.INDEX
        cloud = self.projectLaser(scan_in, range_cutoff, needed)

        points = np.frombuffer(bytearray(cloud.data), _dtype(cloud))
        ratios = points["index"] / max(1, len(scan_in.ranges) - 1)
        place = {
            axis: getattr(first.transform.translation, axis) * (1 - ratios)
            + getattr(last.transform.translation, axis) * ratios
            for axis in "xyz"
        }
        turned = _rotated(points, _interpolated(first, last, ratios))
        for axis in range(3):
            points["xyz"[axis]] = turned[axis] + place["xyz"[axis]]
            if channel_options & self.ChannelOption.VIEWPOINT:
                points[_VIEWPOINT[axis]] = place["xyz"[axis]]

        columns = [
            (field.name, field.datatype, points[field.name])
            for field in cloud.fields
            if field.name != "index" or channel_options & self.ChannelOption.INDEX
        ]
        transformed = _cloud(scan_in, columns, len(points))
        transformed.header = type(cloud.header)(cloud.header.seq, cloud.header.stamp, target_frame)
        return transformed

    def _directions_of(self, scan: LaserScan, count: int) -> Values:
        """Return the cosines and sines of the beams' angles, with shape (2, beams)."""
        import numpy as np

        beams = scan.angle_min, scan.angle_increment, count
        if self._directions is None or self._beams != beams:
            angles = scan.angle_min + np.arange(count) * scan.angle_increment
            self._directions, self._beams = np.array([np.cos(angles), np.sin(angles)]), beams
        return self._directions


def _cloud(scan: LaserScan, columns: Sequence[tuple[str, int, Values | int]], count: int) -> PointCloud2:
    """Return a point cloud with these fields, given as (name, type, values)."""
    import numpy as np

    fields = [PointField(name, 4 * at, datatype, 1) for at, (name, datatype, _) in enumerate(columns)]
    cloud = PointCloud2(header=scan.header, height=1, width=count, fields=fields, point_step=4 * len(fields))
    cloud.row_step = cloud.point_step * count
    points = np.zeros(count, _dtype(cloud))
    for name, _, values in columns:
        points[name] = values
    cloud.data = points.tobytes()
    return cloud


def _dtype(cloud: PointCloud2) -> numpy.dtype[numpy.void]:
    import numpy as np

    return np.dtype([(field.name, "<i4" if field.datatype == _INT32 else "<f4") for field in cloud.fields])


def _later(stamp: genpy.Time, seconds: float) -> genpy.Time:
    import genpy

    return stamp + genpy.Duration.from_sec(seconds)


def _interpolated(first: TransformStamped, last: TransformStamped, ratios: Values) -> Values:
    """Interpolate between two rotations along the shorter arc; return x y z w quaternions with shape (4, ratios)."""
    import numpy as np

    start, end = (
        np.array([getattr(each.transform.rotation, axis) for axis in "xyzw"]) for each in (first, last)
    )
    start, end = (each / (np.linalg.norm(each) or 1.0) for each in (start, end))
    cosine = float(start @ end)
    if cosine < 0:
        cosine, end = -cosine, -end
    angle = math.acos(min(1.0, cosine))
    if math.sin(angle) < 1e-12:
        return np.repeat(start[:, None], len(ratios), axis=1)
    between: Values = (
        np.outer(start, np.sin((1 - ratios) * angle)) + np.outer(end, np.sin(ratios * angle))
    ) / math.sin(angle)
    return between


def _rotated(points: Values, rotations: Values) -> Values:
    """Rotate each point by the rotation with the same index; return an array with shape (3, points)."""
    import numpy as np

    vectors = np.array([points[axis] for axis in "xyz"], np.float64)
    axis, w = rotations[:3], rotations[3]
    twice = 2 * np.cross(axis, vectors, axis=0)
    turned: Values = vectors + w * twice + np.cross(axis, twice, axis=0)
    return turned
