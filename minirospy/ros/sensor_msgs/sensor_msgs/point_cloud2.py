"""sensor_msgs.point_cloud2: converts a PointCloud2's points to tuples or numpy arrays, and back.

Source: http://docs.ros.org/api/sensor_msgs/html/point__cloud2_8py.html. ``read_points_numpy``, and arrays as the argument
``points``, are from ROS 2's sensor_msgs_py.
"""

from __future__ import annotations

import functools
import math
import struct
import sys
from collections import namedtuple
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import islice, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from genpy import Message
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Values: TypeAlias = NDArray[Any]  # point values of any field type

__all__ = [
    "_DATATYPES",
    "PointCloud2",
    "PointField",
    "_get_struct_fmt",
    "create_cloud",
    "create_cloud_xyz32",
    "read_points",
    "read_points_list",
    "read_points_numpy",
]

Point = tuple[Any, ...]

_DATATYPES: dict[int, tuple[str, int]] = {
    PointField.INT8: ("b", 1),
    PointField.UINT8: ("B", 1),
    PointField.INT16: ("h", 2),
    PointField.UINT16: ("H", 2),
    PointField.INT32: ("i", 4),
    PointField.UINT32: ("I", 4),
    PointField.FLOAT32: ("f", 4),
    PointField.FLOAT64: ("d", 8),
}
"""The format character and size in bytes, keyed by field datatype."""

_BLOCK = 4_096  # points to read per step, few enough to fit in the CPU cache

_FEW = 1_000  # below this number of points, plain Python is faster than numpy


class Column(NamedTuple):
    """A field to read: its offset in the point, format character, bytes per value and number of values."""

    offset: int
    format: str
    size: int
    values: int


def read_points(
    cloud: PointCloud2,
    field_names: Collection[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] = (),
) -> Iterator[Point]:
    """Yield a tuple of values for each point: the values of ``field_names``, ordered by the fields' byte offsets.

    ``skip_nans`` omits points with a NaN in one of these fields; ``uvs`` selects the points to yield, as (column, row).
    Raise AssertionError if ``cloud`` is not a PointCloud2, struct.error if the data ends before the last point.
    """
    _check_type(cloud)
    columns = _columns(cloud.fields, field_names)
    point = struct.Struct(_format(cloud.is_bigendian, columns))
    if uvs or cloud.width * cloud.height < _FEW or not _is_whole(cloud, point.size):
        offsets = [cloud.row_step * v + cloud.point_step * u for u, v in uvs] if uvs else _offsets(cloud)
        points = (point.unpack_from(cloud.data, offset) for offset in offsets)
        yield from (each for each in points if not any(map(math.isnan, each))) if skip_nans else points
        return

    for offset, shape in _blocks(cloud):
        # Creating the tuples dominates the run time. zip is fastest because it reuses tuples that the caller has dropped.
        yield from zip(*_values(cloud, columns, offset, shape, skip_nans=skip_nans), strict=True)


def read_points_list(
    cloud: PointCloud2,
    field_names: Collection[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] = (),
) -> list[Point]:
    """Return the points of ``read_points`` as a list of namedtuples.

    Raise the errors that read_points raises, and TypeError if a field has more than one value.
    """
    _check_type(cloud)
    if field_names is None:
        field_names = [field.name for field in cloud.fields]
    named = namedtuple("Point", field_names)  # type: ignore[misc]

    points = read_points(cloud, field_names, skip_nans, uvs)
    # Convert the first point here, so that a field with more than one value raises TypeError immediately.
    # One point is enough, because all points have the same number of values.
    first: list[Point] = [named._make(point) for point in islice(points, 1)]
    return first + list(map(functools.partial(tuple.__new__, named), points))


def read_points_numpy(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] | None = None,
    reshape_organized_cloud: bool = False,
) -> Values:
    """Return the points as an array of shape (points, values), in the order of ``field_names``.

    If ``reshape_organized_cloud``, the shape is (height, width, values). The array is a read-only view of the message's
    data if the values have one type and are evenly spaced, as x, y, z are; else a copy, with a type that can represent all.
    Raise AssertionError if ``cloud`` is not a PointCloud2, ValueError if a field or data is missing.
    """
    _check_type(cloud)
    fields = {field.name: field for field in cloud.fields}
    names = list(fields) if field_names is None else list(field_names)
    if missing := [name for name in names if name not in fields]:
        raise ValueError(f"the cloud has no field {missing[0]!r}, but {', '.join(fields)}")
    columns = [column for name in names for column in _columns([fields[name]], None)]

    array = _as_array(cloud, columns)
    if uvs is not None and (chosen := list(uvs)):
        array = array[[v for _, v in chosen], [u for u, _ in chosen]]
    elif not reshape_organized_cloud:
        array = array.reshape(-1, array.shape[-1])
    if skip_nans and not reshape_organized_cloud and array.dtype.kind == "f":
        import numpy as np

        good = np.ones(array.shape[:-1], bool)
        for at in range(array.shape[-1]):
            good &= ~np.isnan(array[..., at])
        array = array if good.all() else array[good]
    return array


def create_cloud(
    header: Header, fields: Sequence[PointField], points: Sequence[Iterable[float]] | Values
) -> PointCloud2:
    """Return a PointCloud2 with these fields and points.

    Each point has one value per field. ``points`` may be an array with one row per point.

    Raise struct.error if a point has a different number of values, or a value does not fit the field's type.
    """
    columns = _columns(fields, None)
    point = struct.Struct(_format(False, columns))
    data = _packed_array(points, columns, point.size)
    if data is None:
        buffer = bytearray(point.size * len(points))
        for at, each in enumerate(points):
            point.pack_into(buffer, at * point.size, *each)
        data = bytes(buffer)
    return PointCloud2(
        header=header,
        height=1,
        width=len(points),
        is_dense=False,
        is_bigendian=False,
        fields=fields,
        point_step=point.size,
        row_step=point.size * len(points),
        data=data,
    )


def create_cloud_xyz32(header: Header, points: Sequence[Iterable[float]] | Values) -> PointCloud2:
    """Return a cloud of points with x, y and z as 32-bit floats. Raise struct.error if a point does not have three numbers."""
    return create_cloud(
        header, [PointField(name, 4 * at, PointField.FLOAT32, 1) for at, name in enumerate("xyz")], points
    )


def _check_type(cloud: PointCloud2) -> None:
    is_cloud = isinstance(cloud, Message) and cloud._type == "sensor_msgs/PointCloud2"
    assert is_cloud, "cloud is not a sensor_msgs.msg.PointCloud2"


def _get_struct_fmt(
    is_bigendian: bool, fields: Iterable[PointField], field_names: Collection[str] | None = None
) -> str:
    """Return the ``struct`` format of one point. User programs call this function, although it is private in ROS, too."""
    return _format(is_bigendian, _columns(fields, field_names))


def _columns(fields: Iterable[PointField], field_names: Collection[str] | None) -> list[Column]:
    """Return the columns of the named fields. As in ROS, overlapping fields are read one after the other."""
    columns, end = [], 0
    for field in sorted(fields, key=lambda each: each.offset):
        if field_names is not None and field.name not in field_names:
            continue
        end = max(end, field.offset)
        if field.datatype not in _DATATYPES:
            print(f"Skipping unknown PointField datatype [{field.datatype}]", file=sys.stderr)
            continue
        letter, size = _DATATYPES[field.datatype]
        columns.append(Column(end, letter, size, field.count))
        end += size * field.count
    return columns


def _format(is_bigendian: bool, columns: Iterable[Column]) -> str:
    text, end = ">" if is_bigendian else "<", 0
    for offset, letter, size, count in columns:
        text += "x" * (offset - end) + letter * count
        end = offset + size * count
    return text


def _offsets(cloud: PointCloud2) -> Iterator[int]:
    """Yield the byte offset of each point."""
    for row in range(cloud.height):
        for column in range(cloud.width):
            yield cloud.row_step * row + cloud.point_step * column


def _is_whole(cloud: PointCloud2, size: int) -> bool:
    """Return whether the cloud's data is a bytes object with ``point_step`` bytes for each point."""
    if not isinstance(cloud.data, bytes | bytearray | memoryview) or not 0 < size <= cloud.point_step:
        return False
    return len(cloud.data) >= (cloud.height - 1) * cloud.row_step + cloud.width * cloud.point_step


def _blocks(cloud: PointCloud2) -> Iterator[tuple[int, tuple[int, int]]]:
    """Yield the byte offset and the shape (rows, columns) of each block of points in a cloud, in the points' order."""
    height, width = cloud.height, cloud.width
    if cloud.row_step == width * cloud.point_step:
        # If there is no padding between the rows, treat them as a single row.
        height, width = 1, height * width
    rows = max(1, _BLOCK // width)
    for row in range(0, height, rows):
        for column in range(0, width, _BLOCK):
            offset = row * cloud.row_step + column * cloud.point_step
            yield offset, (min(rows, height - row), min(_BLOCK, width - column))


def _values(
    cloud: PointCloud2, columns: Iterable[Column], offset: int, shape: tuple[int, int], *, skip_nans: bool
) -> list[memoryview]:
    """Return a block's values, one sequence per number in a point: a column of three numbers gives three sequences."""
    import numpy as np

    order = ">" if cloud.is_bigendian else "<"
    strides = cloud.row_step, cloud.point_step
    arrays = [
        np.ndarray(shape, order + letter, cloud.data, offset + start + size * at, strides)
        for start, letter, size, count in columns
        for at in range(count)
    ]
    if skip_nans:
        good = np.ones(shape, bool)
        for each in arrays:
            if each.dtype.kind == "f":
                good &= ~np.isnan(each)
        if not good.all():
            arrays = [each[good] for each in arrays]
    # Copy the values, because memoryview reads only aligned values in the machine's byte order.
    copies = [each.astype(each.dtype.newbyteorder("="), order="C") for each in arrays]
    return [each.reshape(-1).data for each in copies]


def _as_array(cloud: PointCloud2, columns: Sequence[Column]) -> Values:
    """Convert the cloud to an array of shape (height, width, values)."""
    import numpy as np

    shape = cloud.height, cloud.width
    order = ">" if cloud.is_bigendian else "<"
    values = [
        (np.dtype(order + letter), offset + size * at)
        for offset, letter, size, count in columns
        for at in range(count)
    ]
    needed = (cloud.height - 1) * cloud.row_step + (cloud.width - 1) * cloud.point_step if all(shape) else 0
    needed += max((offset + dtype.itemsize for dtype, offset in values), default=0) if all(shape) else 0
    if len(cloud.data) < needed:
        raise ValueError(
            f"the cloud of {cloud.height} rows and {cloud.width} columns needs {needed} bytes, "
            f"its data has {len(cloud.data)}"
        )
    if not all(shape) or not values:
        return np.empty((*shape, len(values)), values[0][0] if values else float)

    steps = {after - before for (_, before), (_, after) in pairwise(values)}
    dtypes = {dtype for dtype, _ in values}
    strides = cloud.row_step, cloud.point_step
    if len(dtypes) == 1 and len(steps) <= 1:
        step = steps.pop() if steps else 0
        view: Values = np.ndarray(
            (*shape, len(values)), dtypes.pop(), cloud.data, values[0][1], (*strides, step)
        )
        return view
    with np.errstate(invalid="ignore"):
        # Suppress warnings about NaNs, which are valid values here.
        return np.stack(
            [np.ndarray(shape, dtype, cloud.data, offset, strides) for dtype, offset in values], axis=-1
        )


def _packed_array(points: object, columns: Sequence[Column], step: int) -> bytes | None:
    """Return the packed data if all points and fields are floats; return None if ``struct`` must pack them."""
    numpy = sys.modules.get("numpy")
    if numpy is None or not isinstance(points, numpy.ndarray) or points.ndim != 2 or points.dtype.kind != "f":
        return None
    values = [(f"<{letter}", offset + size * at) for offset, letter, size, n in columns for at in range(n)]
    if len(values) != points.shape[1] or not all(letter[1] in "fd" for letter, _ in values):
        return None

    packed = numpy.zeros((len(points), step), numpy.uint8)
    for at, (letter, offset) in enumerate(values):
        target = numpy.ndarray(len(points), letter, packed, offset, (step,))
        with numpy.errstate(over="ignore"):
            target[:] = points[:, at]
        if not numpy.array_equal(numpy.isinf(target), numpy.isinf(points[:, at])):
            return None
    data: bytes = packed.tobytes()
    return data
