"""ros_numpy.point_cloud2: converts point clouds to structured arrays, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import DTypeLike
from sensor_msgs.msg import PointCloud2, PointField

from minirospy.base.times import Time
from minirospy.ros.ros_numpy.ros_numpy.registry import converts_from_numpy, converts_to_numpy

if TYPE_CHECKING:
    from minirospy.ros.ros_numpy.ros_numpy.registry import Array

__all__ = [
    "array_to_pointcloud2",
    "dtype_to_fields",
    "fields_to_dtype",
    "get_xyz_points",
    "merge_rgb_fields",
    "pointcloud2_to_array",
    "pointcloud2_to_xyz_array",
    "split_rgb_field",
]

_DTYPES = {
    PointField.INT8: "i1",
    PointField.UINT8: "u1",
    PointField.INT16: "i2",
    PointField.UINT16: "u2",
    PointField.INT32: "i4",
    PointField.UINT32: "u4",
    PointField.FLOAT32: "f4",
    PointField.FLOAT64: "f8",
}
_DATATYPES = {np.dtype(dtype): datatype for datatype, dtype in _DTYPES.items()}


@converts_to_numpy(PointField, plural=True)
def fields_to_dtype(
    fields: list[PointField], point_step: int, is_bigendian: bool = False
) -> np.dtype[np.void]:
    """Return the structured dtype for a cloud's fields. Raise ValueError if a field's type is unknown."""
    ordered = sorted(fields, key=lambda each: each.offset)
    for each in ordered:
        if each.datatype not in _DTYPES:
            raise ValueError(f"field {each.name!r} has the unknown datatype {each.datatype}")

    formats = [
        np.dtype(_DTYPES[each.datatype]).newbyteorder(">" if is_bigendian else "<") for each in ordered
    ]
    shaped: list[object] = [
        dtype if each.count == 1 else (dtype, (each.count,))
        for dtype, each in zip(formats, ordered, strict=True)
    ]
    return np.dtype(
        {
            "names": [each.name for each in ordered],
            "formats": shaped,
            "offsets": [each.offset for each in ordered],
            "itemsize": point_step,
        }
    )


@converts_from_numpy(PointField, plural=True)
def dtype_to_fields(dtype: np.dtype[np.void]) -> list[PointField]:
    """Return the PointFields for a structured dtype. Raise KeyError if PointField does not support a field's type."""
    fields = []
    for name in dtype.names or ():
        item, offset = dtype.fields[name][:2]  # type: ignore[index]
        count = int(np.prod(item.shape)) if item.shape else 1
        fields.append(PointField(name, int(offset), _DATATYPES[item.base.newbyteorder("=")], count))
    return fields


@converts_to_numpy(PointCloud2)
def pointcloud2_to_array(cloud_msg: PointCloud2, squeeze: bool = True) -> Array:
    """Return a read-only view of the points with shape (height, width), or (width,) if ``squeeze`` and there is one row.

    Raise ValueError if the message has too little data for its size.
    """
    dtype = fields_to_dtype(cloud_msg.fields, cloud_msg.point_step, bool(cloud_msg.is_bigendian))
    shape = cloud_msg.height, cloud_msg.width
    needed = (
        (cloud_msg.height - 1) * cloud_msg.row_step + cloud_msg.width * cloud_msg.point_step
        if all(shape)
        else 0
    )
    if len(cloud_msg.data) < needed:
        raise ValueError(f"the cloud needs {needed} bytes, its data has {len(cloud_msg.data)}")
    if not needed:
        cloud: Array = np.empty(shape, dtype)
    else:
        cloud = np.ndarray(shape, dtype, cloud_msg.data, 0, (cloud_msg.row_step, cloud_msg.point_step))
    return cloud[0] if squeeze and cloud_msg.height == 1 else cloud


@converts_from_numpy(PointCloud2)
def array_to_pointcloud2(
    cloud_arr: Array, stamp: Time | None = None, frame_id: str | None = None
) -> PointCloud2:
    """Convert a structured array to a point cloud, marked as dense if all values are finite."""
    cloud_arr = np.atleast_2d(cloud_arr)
    cloud = PointCloud2()
    if stamp is not None:
        cloud.header.stamp = stamp
    if frame_id is not None:
        cloud.header.frame_id = frame_id
    cloud.height, cloud.width = cloud_arr.shape
    cloud.fields = dtype_to_fields(cloud_arr.dtype)
    cloud.is_bigendian = False
    cloud.point_step = cloud_arr.dtype.itemsize
    cloud.row_step = cloud.point_step * cloud.width
    cloud.is_dense = all(bool(np.isfinite(cloud_arr[name]).all()) for name in cloud_arr.dtype.names or ())
    cloud.data = cloud_arr.astype(cloud_arr.dtype.newbyteorder("<")).tobytes()
    return cloud


def merge_rgb_fields(cloud_arr: Array) -> Array:
    """Merge the fields r, g and b into a field rgb: a float with the color's bits, as in PCL."""
    red, green, blue = (np.asarray(cloud_arr[name], np.uint32) for name in "rgb")
    merged = _without(cloud_arr, ("r", "g", "b"), [("rgb", np.float32)])
    merged["rgb"] = np.asarray((red << 16) | (green << 8) | blue, np.uint32).view(np.float32)
    return merged


def split_rgb_field(cloud_arr: Array) -> Array:
    """Split the field rgb into three byte fields r, g and b."""
    bits = np.ascontiguousarray(cloud_arr["rgb"], np.float32).view(np.uint32)
    split = _without(cloud_arr, ("rgb",), [(name, np.uint8) for name in "rgb"])
    for name, shift in (("r", 16), ("g", 8), ("b", 0)):
        split[name] = (bits >> shift) & 255
    return split


def _without(cloud: Array, left_out: tuple[str, ...], added: list[tuple[str, type]]) -> Array:
    kept = [name for name in cloud.dtype.names or () if name not in left_out]
    dtype: list[object] = [*((name, cloud.dtype[name]) for name in kept), *added]
    made = np.zeros(cloud.shape, dtype)
    for name in kept:
        made[name] = cloud[name]
    return made


def get_xyz_points(cloud_array: Array, remove_nans: bool = True, dtype: DTypeLike = float) -> Array:
    """Return x, y and z along an array's last axis; if ``remove_nans``, omit points that are not finite."""
    if remove_nans:
        good = np.isfinite(cloud_array["x"]) & np.isfinite(cloud_array["y"]) & np.isfinite(cloud_array["z"])
        cloud_array = cloud_array[good]
    return np.stack([cloud_array[name] for name in "xyz"], axis=-1).astype(dtype)


def pointcloud2_to_xyz_array(cloud_msg: PointCloud2, remove_nans: bool = True) -> Array:
    """Return a point cloud's x, y and z; see ``get_xyz_points``."""
    return get_xyz_points(pointcloud2_to_array(cloud_msg), remove_nans=remove_nans)
