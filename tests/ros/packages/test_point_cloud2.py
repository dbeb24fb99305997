"""sensor_msgs.point_cloud2 as numpy arrays. tests/referee compares the tuples with ROS."""

from __future__ import annotations

import math
import struct
import types
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from minirospy.ros.sensor_msgs.sensor_msgs import point_cloud2 as reading
from tests.conftest import modules_loaded_by

FORMATS = {1: "b", 2: "B", 3: "h", 4: "H", 5: "i", 6: "I", 7: "f", 8: "d"}


def xyz(height: int = 3, width: int = 4, *, padding: int = 0) -> PointCloud2:
    """Return a cloud whose third point has no z."""
    points = [(at, at / 2, float("nan") if at == 2 else -at) for at in range(height * width)]
    cloud = point_cloud2.create_cloud_xyz32(Header(), points)
    cloud.height, cloud.width, cloud.row_step = height, width, 12 * width + padding
    rows = [cloud.data[at : at + 12 * width] for at in range(0, len(cloud.data), 12 * width)]
    cloud.data = b"".join(row + bytes(padding) for row in rows)
    return cloud


@st.composite
def clouds(draw: st.DrawFn) -> PointCloud2:
    """Return a cloud of random bytes, with gaps between the fields, and after points and rows."""
    fields, end = [], 0
    for number in range(draw(st.integers(1, 4))):
        datatype, count = draw(st.integers(1, 8)), draw(st.integers(1, 3))
        offset = end + draw(st.integers(0, 3))
        fields.append(PointField(f"f{number}", offset, datatype, count))
        end = offset + count * struct.calcsize(FORMATS[datatype])
    step = end + draw(st.integers(0, 5))
    height, width = draw(st.integers(0, 12)), draw(st.integers(0, 40))
    row_step = step * width + draw(st.integers(0, 5))
    seed = draw(st.integers(0, 2**32))
    data = np.random.default_rng(seed).integers(0, 256, height * row_step, np.uint8).tobytes()
    return PointCloud2(
        None, height, width, draw(st.permutations(fields)), draw(st.booleans()), step, row_step, data, False
    )


def slowly(cloud: PointCloud2, *, skip_nans: bool) -> list[tuple[float, ...]]:
    """Return the points as ROS reads them, each with struct."""
    fmt, end = ">" if cloud.is_bigendian else "<", 0
    for field in sorted(cloud.fields, key=lambda each: each.offset):
        fmt += "x" * (field.offset - end) + FORMATS[field.datatype] * field.count
        end = struct.calcsize(fmt)
    offsets = [
        v * cloud.row_step + u * cloud.point_step for v in range(cloud.height) for u in range(cloud.width)
    ]
    points = [struct.unpack_from(fmt, cloud.data, offset) for offset in offsets]
    return [each for each in points if not (skip_nans and any(map(math.isnan, each)))]


@given(clouds(), st.booleans(), st.sampled_from([1, 7, 50, 4096]), st.sampled_from([1, 1000]))
def test_points_are_those_of_struct(cloud: PointCloud2, skip_nans: bool, block: int, few: int) -> None:
    with mock.patch.object(reading, "_BLOCK", block), mock.patch.object(reading, "_FEW", few):
        found = list(point_cloud2.read_points(cloud, skip_nans=skip_nans))
    assert repr(found) == repr(slowly(cloud, skip_nans=skip_nans))


def test_points_of_a_large_cloud_come_from_a_generator() -> None:
    cloud = xyz(40, 300, padding=8)
    points = point_cloud2.read_points(cloud)
    assert isinstance(points, types.GeneratorType)
    assert next(points) == (0.0, 0.0, 0.0)
    points.close()
    assert next(points, None) is None
    assert repr(list(point_cloud2.read_points(cloud))) == repr(slowly(cloud, skip_nans=False))


@given(clouds())
def test_array_has_the_values_of_the_tuples(cloud: PointCloud2) -> None:
    names = [field.name for field in sorted(cloud.fields, key=lambda each: each.offset)]
    array = point_cloud2.read_points_numpy(cloud, names)
    tuples = slowly(cloud, skip_nans=False)
    assert array.shape == (len(tuples), sum(field.count for field in cloud.fields))
    np.testing.assert_array_equal(array, np.array(tuples).reshape(array.shape))


@pytest.mark.parametrize("padding", [0, 6])
def test_array_of_xyz(padding: int) -> None:
    cloud = xyz(padding=padding)
    array = point_cloud2.read_points_numpy(cloud, ("x", "y", "z"))
    assert array.shape == (12, 3)
    assert array[1].tolist() == [1.0, 0.5, -1.0]
    assert point_cloud2.read_points_numpy(cloud, ("z", "x"))[1].tolist() == [-1.0, 1.0]
    assert point_cloud2.read_points_numpy(cloud, skip_nans=True).shape == (11, 3)
    assert point_cloud2.read_points_numpy(cloud, uvs=[(3, 2), (0, 1)])[:, 0].tolist() == [11.0, 4.0]
    organized = point_cloud2.read_points_numpy(cloud, reshape_organized_cloud=True)
    assert organized.shape == (3, 4, 3)
    assert organized[2, 3].tolist() == [11.0, 5.5, -11.0]


def test_array_of_xyz_is_a_view() -> None:
    cloud = xyz()
    array = point_cloud2.read_points_numpy(cloud)
    assert np.shares_memory(array, np.frombuffer(cloud.data, np.uint8))
    assert not array.flags.writeable


def test_array_of_what_is_missing_is_refused() -> None:
    cloud = xyz()
    with pytest.raises(ValueError, match="the cloud has no field 'rgb', but x, y, z"):
        point_cloud2.read_points_numpy(cloud, ("x", "rgb"))
    cloud.data = cloud.data[:-1]
    with pytest.raises(
        ValueError, match="the cloud of 3 rows and 4 columns needs 144 bytes, its data has 143"
    ):
        point_cloud2.read_points_numpy(cloud)
    with pytest.raises(AssertionError, match="not a sensor_msgs"):
        point_cloud2.read_points_numpy(Header())


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.float16])
def test_cloud_of_an_array_is_that_of_its_rows(dtype: type[np.floating]) -> None:
    points = np.array([[1.5, -2, np.nan], [np.inf, 0, 3]], dtype)
    fields = [PointField("a", 2, 8, 1), PointField("b", 12, 7, 2)]
    cloud = point_cloud2.create_cloud(Header(), fields, points)
    assert cloud == point_cloud2.create_cloud(Header(), fields, points.tolist())


def test_array_with_invalid_elements_is_refused_as_rows_are() -> None:
    with pytest.raises(OverflowError, match="too large"):
        point_cloud2.create_cloud_xyz32(Header(), np.array([[1, 2, 1e300]]))
    with pytest.raises(struct.error, match="expected 3 items"):
        point_cloud2.create_cloud_xyz32(Header(), np.ones((5, 2)))
    fields = [PointField("a", 0, PointField.UINT16, 1)]
    assert point_cloud2.create_cloud(Header(), fields, np.array([[5], [6]])).data == b"\5\0\6\0"
    with pytest.raises(struct.error, match="integer"):
        point_cloud2.create_cloud(Header(), fields, np.array([[5.5]]))


def test_unknown_type_of_a_field_is_skipped_with_a_warning(capsys: pytest.CaptureFixture[str]) -> None:
    cloud = xyz()
    cloud.fields[1].datatype = 99
    assert next(point_cloud2.read_points(cloud)) == (0.0, 0.0)
    assert capsys.readouterr().err == "Skipping unknown PointField datatype [99]\n"


def test_import_leaves_numpy_unloaded() -> None:
    assert "numpy" not in modules_loaded_by("import sensor_msgs.point_cloud2")
