"""tf2_sensor_msgs: transforms point clouds for tf2_ros. Source: http://wiki.ros.org/tf2_sensor_msgs.

Importing this module registers PointCloud2 with tf2_ros. numpy is imported when the first cloud is transformed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointCloud2, PointField

from minirospy.ros.tf2_geometry_msgs.tf2_geometry_msgs.tf2_geometry_msgs import (
    from_msg_msg,
    to_msg_msg,
    transform_to_kdl,
)
from minirospy.ros.tf2_ros.tf2_ros.interface import ConvertRegistration, TransformRegistration

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

__all__ = ["PointCloud2", "do_transform_cloud", "from_msg_msg", "to_msg_msg", "transform_to_kdl"]

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
    """Return the cloud with its x, y and z transformed into another frame, with the transform's header.

    As in real ROS, the result has one row, little-endian numbers, zeros between a point's fields and nothing after the
    last one, and is not marked as dense. Other fields, and points with NaN coordinates, are kept. x, y and z are the
    fields with these names, whereas real ROS uses the first three fields. Raise ValueError if the cloud has no x, y and
    z, or less data than its sizes require.
    """
    import numpy

    points = _points(cloud)
    names = points.dtype.names or ()
    missing = {"x", "y", "z"} - set(names)
    if missing:
        raise ValueError(
            f"the cloud has no field {', '.join(sorted(missing))}: there is nothing to transform"
        )
    layout = _layout(cloud.fields, "<")
    result = numpy.zeros(len(points), layout)
    for name in names:
        result[name] = points[name]

    frame = transform_to_kdl(transform)
    rotation = numpy.array(frame.M._m).reshape(3, 3)
    places = numpy.stack([points[name].astype(numpy.float64) for name in "xyz"], axis=-1)
    # Ignore warnings: coordinates may be infinite, or may overflow in the calculation.
    with numpy.errstate(invalid="ignore", over="ignore"):
        moved = places @ rotation.T + numpy.array(frame.p._v)
        for column, name in enumerate("xyz"):
            result[name] = moved[:, column]

    return PointCloud2(
        header=transform.header,
        height=1,
        width=len(result),
        fields=cloud.fields,
        is_bigendian=False,
        point_step=layout.itemsize,
        row_step=layout.itemsize * len(result),
        data=result.tobytes(),
        is_dense=False,
    )


def _points(cloud: PointCloud2) -> NDArray[numpy.void]:
    """Return the points as a one-dimensional structured array, without row padding."""
    import numpy

    try:
        layout = _layout(cloud.fields, ">" if cloud.is_bigendian else "<", cloud.point_step)
        rows = numpy.frombuffer(cloud.data, numpy.uint8, cloud.height * cloud.row_step)
    except ValueError as error:
        raise ValueError(f"the cloud does not fit its own description: {error}") from None
    rows = rows.reshape(cloud.height, cloud.row_step)[:, : cloud.width * cloud.point_step]
    return numpy.ascontiguousarray(rows).reshape(-1).view(layout)


def _layout(fields: Sequence[PointField], order: str, step: int | None = None) -> numpy.dtype[numpy.void]:
    """Return the dtype of a point with ``step`` bytes (default: up to the end of the last field).

    Raise ValueError if the fields do not fit.
    """
    import numpy

    known = [field for field in fields if field.datatype in _FORMATS]
    formats = [numpy.dtype(_format(order, field)) for field in known]
    if step is None:
        step = max((f.offset + kind.itemsize for f, kind in zip(known, formats, strict=True)), default=0)
    return numpy.dtype(
        {
            "names": [field.name for field in known],
            "formats": formats,
            "offsets": [field.offset for field in known],
            "itemsize": step,
        }
    )


def _format(order: str, field: PointField) -> str | tuple[str, tuple[int]]:
    kind = order + _FORMATS[field.datatype]
    return (kind, (field.count,)) if field.count != 1 else kind


TransformRegistration().add(PointCloud2, do_transform_cloud)
ConvertRegistration().add_to_msg(PointCloud2, to_msg_msg)
ConvertRegistration().add_from_msg(PointCloud2, from_msg_msg)
