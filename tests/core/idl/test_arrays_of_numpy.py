"""numpy arrays as field values: any shape, and any number type that matches."""

from __future__ import annotations

import array
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovariance
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan

from minirospy.base.errors import SerializationError


def written(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


@pytest.mark.parametrize("kind", ["<f4", "<f8", ">f4", "<i4", "bool"])
def test_numbers_of_any_kind_and_shape(kind: str) -> None:
    values = np.arange(6).reshape(2, 3).astype(kind)
    expected = LaserScan(ranges=[float(value) for value in values.ravel()])
    assert written(LaserScan(ranges=values)) == written(expected)
    assert written(LaserScan(ranges=values.T)) == written(LaserScan(ranges=values.T.ravel().tolist()))


def test_an_array_of_the_standard_library() -> None:
    assert written(JointState(position=array.array("d", [1, 2]))) == written(JointState(position=[1, 2]))
    assert written(JointState(position=range(3))) == written(JointState(position=[0, 1, 2]))


def test_an_image_of_any_shape() -> None:
    picture = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    for data in (picture, bytearray(bytes(24)) and picture.tobytes(), memoryview(picture), list(range(24))):
        message = Image().deserialize(written(Image(data=data)))
        assert message.data == bytes(range(24))


@pytest.mark.parametrize("data", [np.zeros(3), "abc", 5, [300]])
def test_value_that_is_not_bytes_is_refused(data: Any) -> None:
    with pytest.raises(SerializationError):
        written(Image(data=data))


def test_matrix_in_a_field_of_fixed_length_is_written_row_by_row() -> None:
    numbers = np.arange(36.0)
    flat = written(PoseWithCovariance(covariance=numbers.tolist()))
    for shape in ((6, 6), (1, 36), (4, 9), (2, 3, 6)):
        assert written(PoseWithCovariance(covariance=numbers.reshape(shape))) == flat
    assert written(PoseWithCovariance(covariance=np.asfortranarray(numbers.reshape(6, 6)))) == flat
    assert written(PoseWithCovariance(covariance=numbers.reshape(6, 6).astype("int8"))) == flat
    nested = Odometry()
    nested.pose.covariance = numbers.reshape(6, 6).T
    assert Odometry().deserialize(written(nested)).pose.covariance[:3] == (0.0, 6.0, 12.0)
    camera = CameraInfo().deserialize(written(CameraInfo(K=np.eye(3), P=np.eye(3, 4, dtype="float32"))))
    assert camera.K == (1, 0, 0, 0, 1, 0, 0, 0, 1)
    assert camera.P == (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)
    PoseWithCovariance(covariance=np.eye(6))._check_types()


@pytest.mark.parametrize(
    ("shape", "text"),
    [
        ((6, 5), "field covariance has shape (6, 5) instead of 36 values"),
        ((36, 2), "field covariance has shape (36, 2) instead of 36 values"),
        ((36, 1), "field covariance has shape (36, 1) instead of 36 values: use reshape(-1)"),
    ],
)
def test_matrix_of_another_count_is_refused_with_its_shape(shape: tuple[int, ...], text: str) -> None:
    with pytest.raises(SerializationError) as error:
        written(PoseWithCovariance(covariance=np.zeros(shape)))
    assert str(error.value) == text


def test_count_of_a_flat_array_is_named() -> None:
    with pytest.raises(SerializationError, match=r"^covariance has 35 values instead of 36$"):
        written(PoseWithCovariance(covariance=np.zeros(35)))
    with pytest.raises(SerializationError, match=r"^field K\[\] must be float type$"):
        written(CameraInfo(K=[[1.0, 0.0, 0.0]] * 3))
