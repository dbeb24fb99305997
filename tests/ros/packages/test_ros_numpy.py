"""ros_numpy: conversion of messages to arrays and back."""

from __future__ import annotations

import numpy as np
import pytest
import ros_numpy
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import String

from minirospy.ros.ros_numpy.ros_numpy import registry

POINTS = np.zeros(
    5,
    dtype=[
        ("x", "f4"),
        ("y", "f4"),
        ("z", "f8"),
        ("normal", "f4", (3,)),
        ("r", "u1"),
        ("g", "u1"),
        ("b", "u1"),
    ],
)
POINTS["x"] = np.arange(5)
POINTS["normal"] = np.arange(15).reshape(5, 3)
POINTS["g"] = 200
POINTS["b"] = 7


@pytest.mark.parametrize("shape", [(5,), (5, 1), (1, 5), (0,)])
def test_clouds(shape: tuple[int, ...]) -> None:
    array = POINTS[: int(np.prod(shape))].reshape(shape)
    message = ros_numpy.msgify(PointCloud2, array, frame_id="map")
    assert (message.header.frame_id, message.point_step, message.is_dense) == ("map", POINTS.itemsize, True)
    back = ros_numpy.numpify(message)
    expected = array.reshape(-1) if message.height == 1 else array
    assert back.shape == expected.shape
    for name in POINTS.dtype.names or ():
        np.testing.assert_array_equal(back[name], expected[name])


def test_padding_and_byte_order_of_clouds() -> None:
    message = ros_numpy.msgify(PointCloud2, POINTS[:4].reshape(2, 2))
    message.data = message.data[: message.row_step] + b"xyz" + message.data[message.row_step :]
    message.row_step += 3
    assert ros_numpy.numpify(message)["x"].tolist() == [[0, 1], [2, 3]]
    message.data = message.data[:-1]
    with pytest.raises(ValueError, match="the cloud needs"):
        ros_numpy.numpify(message)


def test_points_without_nans_and_colors() -> None:
    array = POINTS.copy()
    array["y"][1] = np.nan
    assert ros_numpy.point_cloud2.pointcloud2_to_xyz_array(ros_numpy.msgify(PointCloud2, array)).shape == (
        4,
        3,
    )
    merged = ros_numpy.point_cloud2.merge_rgb_fields(POINTS)
    assert merged["rgb"].view("u4")[0] == 200 << 8 | 7
    split = ros_numpy.point_cloud2.split_rgb_field(merged)
    assert (split["r"][0], split["g"][0], split["b"][0]) == (0, 200, 7)


def test_images() -> None:
    array = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    message = ros_numpy.msgify(Image, array, encoding="rgb8")
    np.testing.assert_array_equal(ros_numpy.numpify(message), array)
    with pytest.raises(TypeError, match="Array has 3 channels, mono8 requires 1"):
        ros_numpy.msgify(Image, array, "mono8")
    with pytest.raises(TypeError, match="Array is uint8, 32FC3 requires float32"):
        ros_numpy.msgify(Image, array, "32FC3")


def test_maps() -> None:
    array = np.array([[0, -1, 100], [1, 2, 3]], np.int8)
    grid = ros_numpy.msgify(OccupancyGrid, array)
    assert (grid.info.width, grid.info.height, list(grid.data)) == (3, 2, [0, -1, 100, 1, 2, 3])
    back = ros_numpy.numpify(grid)
    assert back.mask.tolist() == [[False, True, False], [False] * 3]
    assert ros_numpy.msgify(OccupancyGrid, back) == grid
    with pytest.raises(TypeError, match="int8"):
        ros_numpy.msgify(OccupancyGrid, array.astype(int))


def test_geometry() -> None:
    assert ros_numpy.numpify(Point(1, 2, 3), hom=True).tolist() == [1, 2, 3, 1]
    assert ros_numpy.numpify(Vector3(1, 2, 3), hom=True).tolist() == [1, 2, 3, 0]
    assert ros_numpy.msgify(Point, np.array([2, 4, 6, 2.0])) == Point(1, 2, 3)
    assert ros_numpy.msgify(Vector3, np.arange(6.0).reshape(2, 3))[1] == Vector3(3, 4, 5)
    quarter = Quaternion(0, 0, np.sqrt(0.5), np.sqrt(0.5))
    for cls, place in ((Pose, Point), (Transform, Vector3)):
        matrix = ros_numpy.numpify(cls(place(1, 2, 3), quarter))
        np.testing.assert_allclose(matrix @ [1, 0, 0, 1], [1, 3, 3, 1], atol=1e-12)
        back = ros_numpy.msgify(cls, np.stack([matrix, matrix]))
        np.testing.assert_allclose(ros_numpy.numpify(back[1]), matrix, atol=1e-12)


def test_types_that_are_not_known_are_refused() -> None:
    for call in (lambda: ros_numpy.numpify(String()), lambda: ros_numpy.msgify(String, np.zeros(3))):
        with pytest.raises(ValueError, match=r"std_msgs/String - only supports .*sensor_msgs/Image"):
            call()
    with pytest.raises(ValueError, match="empty Collection"):
        ros_numpy.numpify([])
    assert ros_numpy.numpify(None) is None


def test_a_program_adds_its_own_type() -> None:
    @ros_numpy.converts_to_numpy(String)
    def convert(message: String) -> np.ndarray:
        return np.frombuffer(message.data.encode(), np.uint8)

    try:
        assert ros_numpy.numpify(String("ab")).tolist() == [97, 98]
    finally:
        del registry._to_numpy["std_msgs/String", False]
