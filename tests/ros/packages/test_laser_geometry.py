"""laser_geometry: faults, the cache of directions, and clouds from a moving laser. tests/referee compares the bytes."""

from __future__ import annotations

import math

import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from laser_geometry import LaserProjection
from sensor_msgs import point_cloud2
from sensor_msgs.msg import LaserScan

OPTION = LaserProjection.ChannelOption


def scan(**changed: object) -> LaserScan:
    made = LaserScan(angle_min=0.0, angle_max=math.pi, angle_increment=math.pi / 2, range_max=10.0)
    made.header.frame_id, made.header.stamp, made.time_increment = "laser", rospy.Time(10), 0.5
    made.ranges = [1.0, 2.0, 3.0]
    for name, value in changed.items():
        setattr(made, name, value)
    return made


def points(cloud: object) -> list[list[float]]:
    return [[round(value, 5) for value in each] for each in point_cloud2.read_points(cloud)]


def test_increment_that_changes_gives_new_directions() -> None:
    projection = LaserProjection()
    projection.projectLaser(scan())
    turned = projection.projectLaser(scan(angle_increment=0.0), channel_options=OPTION.NONE)
    assert points(turned) == [[1, 0, 0], [2, 0, 0], [3, 0, 0]]


def test_scan_with_too_few_intensities_is_refused() -> None:
    with pytest.raises(IndexError, match="the scan has 3 ranges and 1 intensities"):
        LaserProjection().projectLaser(scan(intensities=[1.0]))


def buffer(*poses: tuple[float, float, float, float]) -> tf2_ros.Buffer:
    """Return a buffer with poses of the laser, each given as (seconds, x, y, angle)."""
    made = tf2_ros.Buffer(debug=False)
    for seconds, x, y, angle in poses:
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = "map", "laser"
        transform.header.stamp = rospy.Time.from_sec(seconds)
        transform.transform.translation.x, transform.transform.translation.y = x, y
        transform.transform.rotation.z, transform.transform.rotation.w = (
            math.sin(angle / 2),
            math.cos(angle / 2),
        )
        made.set_transform(transform, "test")
    return made


def test_points_are_where_the_moving_laser_saw_them() -> None:
    moving = buffer((10, 0, 0, 0), (11, 4, 0, math.pi / 2))
    cloud = LaserProjection().transformLaserScanToPointCloud(
        "map", scan(), moving, channel_options=OPTION.VIEWPOINT
    )
    assert (cloud.header.frame_id, cloud.header.stamp) == ("map", rospy.Time(10))
    half = math.sqrt(2)
    assert points(cloud) == [
        [1, 0, 0, 0, 0, 0],
        [round(2 - half, 5), round(half, 5), 0, 2, 0, 0],
        [4, -3, 0, 4, 0, 0],
    ]


def test_points_left_out_do_not_move_the_others() -> None:
    moving = buffer((10, 0, 0, 0), (11, 4, 0, 0))
    cloud = LaserProjection().transformLaserScanToPointCloud("map", scan(ranges=[99.0, 2.0, 3.0]), moving)
    assert points(cloud) == [[2, 2, 0, 1], [1, 0, 0, 2]]


@pytest.mark.parametrize("ranges", [[], [1.0]])
def test_shortest_scans_are_transformed(ranges: list[float]) -> None:
    cloud = LaserProjection().transformLaserScanToPointCloud(
        "map", scan(ranges=ranges), buffer((10, 4, 0, 0))
    )
    assert points(cloud) == [[5, 0, 0, 0]][: len(ranges)]


def test_missing_transform_is_named() -> None:
    with pytest.raises(tf2_ros.LookupException, match="nowhere"):
        LaserProjection().transformLaserScanToPointCloud("nowhere", scan(), buffer((10, 0, 0, 0)))
