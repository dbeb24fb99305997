"""numpy arrays as field values: any shape, and any number type that matches."""

from __future__ import annotations

import array
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from sensor_msgs.msg import Image, JointState, LaserScan

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
