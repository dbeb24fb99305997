"""tf2_sensor_msgs: point clouds that tf2_ros transforms. Source: http://wiki.ros.org/tf2_sensor_msgs.

Importing it registers PointCloud2 with tf2_ros. numpy is imported by the first cloud.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointCloud2, PointField

from minirospy.compat.tf2_geometry_msgs.tf2_geometry_msgs import from_msg_msg, to_msg_msg, transform_to_kdl
from minirospy.frames.interface import ConvertRegistration, TransformRegistration

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

__all__ = ["do_transform_cloud", "from_msg_msg", "to_msg_msg", "transform_to_kdl"]

_FORMATS = {
    PointField.INT8: "i1",
    PointField.UINT8: "u1",
    PointField.INT16: "i2",
    PointField.UINT16: "u2",
    PointField.INT32: "i4",
    PointField.UINT32: "u4",
    PointField.FLOAT32: "f4",
    PointField.FLOAT64: "f8",
}


def do_transform_cloud(cloud: PointCloud2, transform: TransformStamped) -> PointCloud2:
    """Return a cloud whose x, y and z the transform has moved, with the transform's header.

    The result has one row, as with the real one; the other fields and the points without a place (NaN) are kept. Raise
    ValueError where the cloud has no x, y and z, or fewer bytes than it says.
    """
    import numpy

    points = _points(cloud).copy()
    missing = {"x", "y", "z"} - set(points.dtype.names or ())
    if missing:
        raise ValueError(
            f"the cloud has no field {', '.join(sorted(missing))}: there is nothing to transform"
        )
    frame = transform_to_kdl(transform)
    rotation = numpy.array(frame.M._m).reshape(3, 3)
    places = numpy.stack([points[name].astype(numpy.float64) for name in "xyz"], axis=-1)
    moved = places @ rotation.T + numpy.array(frame.p._v)
    for column, name in enumerate("xyz"):
        points[name] = moved[:, column]

    return PointCloud2(
        header=transform.header,
        height=1,
        width=len(points),
        fields=cloud.fields,
        is_bigendian=cloud.is_bigendian,
        point_step=cloud.point_step,
        row_step=cloud.point_step * len(points),
        data=points.tobytes(),
        is_dense=cloud.is_dense,
    )


def _points(cloud: PointCloud2) -> NDArray[numpy.void]:
    """Return the points as a structured array, one after the other, without the rests of rows."""
    import numpy

    order = ">" if cloud.is_bigendian else "<"
    known = [field for field in cloud.fields if field.datatype in _FORMATS]
    try:
        layout: numpy.dtype[numpy.void] = numpy.dtype(
            {
                "names": [field.name for field in known],
                "formats": [_format(order, field) for field in known],
                "offsets": [field.offset for field in known],
                "itemsize": cloud.point_step,
            }
        )
        rows = numpy.frombuffer(cloud.data, numpy.uint8, cloud.height * cloud.row_step)
    except ValueError as error:
        raise ValueError(f"the cloud does not fit its own description: {error}") from None
    rows = rows.reshape(cloud.height, cloud.row_step)[:, : cloud.width * cloud.point_step]
    return numpy.ascontiguousarray(rows).reshape(-1).view(layout)


def _format(order: str, field: PointField) -> str | tuple[str, tuple[int]]:
    kind = order + _FORMATS[field.datatype]
    return (kind, (field.count,)) if field.count > 1 else kind


TransformRegistration().add(PointCloud2, do_transform_cloud)
ConvertRegistration().add_to_msg(PointCloud2, to_msg_msg)
ConvertRegistration().add_from_msg(PointCloud2, from_msg_msg)
