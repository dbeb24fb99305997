"""PyKDL: rejected arguments. tests/referee/cases/frames_kdl.py compares the rest with the real PyKDL."""

from __future__ import annotations

import math
import struct
import warnings

import numpy
import PyKDL
import pytest
import tf2_kdl
import tf2_ros
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointCloud2, PointField
from tf2_sensor_msgs import do_transform_cloud

from minirospy.base import times


def transform() -> TransformStamped:
    message = TransformStamped(child_frame_id="base")
    message.header.frame_id = "map"
    message.transform.translation.x = 10.0
    message.transform.rotation.z = message.transform.rotation.w = math.sqrt(0.5)
    return message


@pytest.mark.parametrize(
    "name", ["ChainFkSolverPos_recursive", "ChainIkSolverPos_LMA", "Tree", "JntArray", "Multiply"]
)
def test_solvers_refuse_by_name(name: str) -> None:
    with pytest.raises(NotImplementedError, match=rf"^PyKDL.{name}: minirospy has .* python3-pykdl$"):
        getattr(PyKDL, name)(1)


@pytest.mark.parametrize(
    "make",
    [
        lambda: PyKDL.Vector(1, 2),  # type: ignore[call-overload]
        lambda: PyKDL.Vector("1", 2, 3),  # type: ignore[call-overload]
        lambda: PyKDL.Rotation(1, 2),
        lambda: PyKDL.Frame(5),  # type: ignore[arg-type]
        lambda: PyKDL.Vector() + 1,  # type: ignore[operator]
        lambda: PyKDL.Frame() * 2,  # type: ignore[operator]
        lambda: PyKDL.dot(PyKDL.Vector(), PyKDL.Twist()),
        lambda: PyKDL.Equal(PyKDL.Vector(), PyKDL.Twist()),
        lambda: PyKDL.Frame().Inverse(5),  # type: ignore[call-overload]
        lambda: hash(PyKDL.Vector()),
    ],
)
def test_wrong_arguments_are_type_errors(make: object) -> None:
    assert callable(make)
    with pytest.raises(TypeError):
        make()


@pytest.mark.parametrize("off", [1e-8, 9e-7, 1.1e-6])
def test_objects_within_a_millionth_are_equal(off: float) -> None:
    a, b = PyKDL.Vector(1, 2, 3), PyKDL.Vector(1, 2, 3 + off)
    m, n = PyKDL.Rotation(), PyKDL.Rotation(1, 0, 0, 0, 1 + off, 0, 0, 0, 1)

    is_equal = off < 1e-6
    assert (a == b, a != b) == (is_equal, not is_equal)
    assert (PyKDL.Twist(a, a) == PyKDL.Twist(a, b)) is is_equal
    assert (PyKDL.Wrench(a, a) == PyKDL.Wrench(a, b)) is is_equal
    assert (PyKDL.Frame(m, a) == PyKDL.Frame(m, b)) is is_equal
    assert (m == n, PyKDL.Frame(m) == PyKDL.Frame(n)) == (is_equal, is_equal)


def test_stamped_kdl_objects_are_transformed() -> None:
    registration = tf2_ros.TransformRegistration()
    vector = tf2_ros.Stamped(PyKDL.Vector(1, 2, 3), times.Time(5), "base")
    moved = registration.get(PyKDL.Vector)(vector, transform())
    assert [moved[n] for n in range(3)] == pytest.approx([8, 1, 3])
    assert moved.header.frame_id == "map"
    message = tf2_kdl.to_msg_vector(moved)
    assert message.point.x == pytest.approx(8)
    assert tf2_kdl.from_msg_vector(message)[1] == pytest.approx(1)
    assert tf2_ros.convert(moved, PyKDL.Vector) == moved
    for thing in (PyKDL.Frame(PyKDL.Vector(1, 0, 0)), PyKDL.Twist(), PyKDL.Wrench()):
        result = registration.get(type(thing))(thing, transform())
        assert type(result) is type(thing)
        assert result.header.frame_id == "map"


def cloud(*, rows: int = 2, pad: int = 4, order: str = "<") -> PointCloud2:
    layout = numpy.dtype(
        {
            "names": ["x", "y", "z", "c"],
            "formats": [order + "f4"] * 3 + ["u1"],
            "offsets": [0, 4, 8, 12],
            "itemsize": 16,
        }
    )
    points = numpy.zeros((rows, 3), layout)
    points["x"], points["c"] = numpy.arange(rows * 3).reshape(rows, 3), 7
    points["y"][0, 1] = numpy.nan
    data = b"".join(row.tobytes() + b"\xff" * pad for row in points)
    fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
    fields.append(PointField("c", 12, PointField.UINT8, 1))
    return PointCloud2(
        height=rows,
        width=3,
        fields=fields,
        is_bigendian=order == ">",
        point_step=16,
        row_step=48 + pad,
        data=data,
    )


@pytest.mark.parametrize("order", ["<", ">"])
def test_clouds_of_several_rows_keep_their_other_fields(order: str) -> None:
    moved = do_transform_cloud(cloud(order=order), transform())
    assert (moved.height, moved.width, moved.point_step, moved.row_step) == (1, 6, 13, 78)
    assert (moved.is_bigendian, moved.is_dense, len(moved.data)) == (False, False, 78)
    layout = numpy.dtype({"names": ["xyz", "c"], "formats": [("<f4", 3), "u1"], "offsets": [0, 12]})
    points = numpy.frombuffer(moved.data, layout)
    assert points["xyz"][[0, 2, 3, 4, 5], 1].tolist() == pytest.approx([0, 2, 3, 4, 5], abs=1e-6)
    assert points["xyz"][0, 0] == pytest.approx(10)
    assert numpy.isnan(points["xyz"][1]).all()
    assert points["c"].tolist() == [7] * 6


def test_padding_between_fields_of_a_cloud_becomes_zeros() -> None:
    fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
    fields += [PointField("i", 16, PointField.UINT16, 1), PointField("none", 18, PointField.UINT8, 0)]
    source = PointCloud2(height=1, width=1, fields=fields, point_step=24, row_step=24, is_dense=True)
    source.data = struct.pack("<3fIHHI", 0, 0, math.inf, 0xFFFFFFFF, 5, 0xFFFF, 0xFFFFFFFF)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        moved = do_transform_cloud(source, transform())
    assert (moved.point_step, moved.is_dense, moved.fields) == (18, False, fields)
    assert moved.data[12:] == struct.pack("<IH", 0, 5)


def test_clouds_that_do_not_fit_their_description_are_named() -> None:
    short = cloud()
    short.data = short.data[:-1]
    with pytest.raises(ValueError, match="does not fit its own description"):
        do_transform_cloud(short, transform())
    flat = cloud()
    flat.fields = flat.fields[:2]
    with pytest.raises(ValueError, match="no field z"):
        do_transform_cloud(flat, transform())
