"""laser_geometry: the point cloud from a scan by a moving laser, compared with that of the C++ class (laser_peer.cpp)."""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from laser_geometry import LaserProjection
from sensor_msgs import point_cloud2
from sensor_msgs.msg import LaserScan

from tests.interop.conftest import PATIENCE, compiled


def moving_laser() -> tf2_ros.Buffer:
    buffer = tf2_ros.Buffer(debug=False)
    for at in range(2):
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = "map", "laser"
        transform.header.stamp = rospy.Time(10 + at)
        place, turned = transform.transform.translation, transform.transform.rotation
        place.x, place.y, place.z = 1 + 2 * at, -3 * at, 0.5 * at
        length = math.sqrt(1 - 0.09 * at)
        turned.x, turned.z, turned.w = (
            0.3 * at,
            math.sin(0.2 + 0.9 * at) * length,
            math.cos(0.2 + 0.9 * at) * length,
        )
        buffer.set_transform(transform, "test")
    return buffer


def scan() -> LaserScan:
    made = LaserScan(angle_min=-2.0, angle_max=2.0, angle_increment=4.0 / 99, time_increment=0.008)
    made.header.frame_id, made.header.stamp = "laser", rospy.Time(10, 100_000_000)
    made.range_min, made.range_max = 0.5, 9.0
    made.ranges = [20.0 if at % 7 == 3 else 1.0 + at * 0.07 for at in range(100)]
    made.intensities = [float(at) for at in range(100)]
    return made


def test_clouds_of_a_moving_laser_are_those_of_the_cpp_class(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    peer = compiled("laser_peer.cpp", tmp_path_factory, "laser_geometry", "tf2", "roscpp", "sensor_msgs")
    printed = subprocess.run([peer], capture_output=True, text=True, timeout=PATIENCE, check=True).stdout
    clouds = printed.split("cloud ")[1:]
    assert len(clouds) == 4
    for text in clouds:
        (options, frame, stamp, width, *names), *rows = (line.split() for line in text.splitlines())
        ours = LaserProjection().transformLaserScanToPointCloud(
            "map", scan(), moving_laser(), channel_options=int(options)
        )
        assert (ours.header.frame_id, ours.header.stamp.to_sec(), ours.width) == (
            frame,
            float(stamp),
            int(width),
        )
        assert [field.name for field in ours.fields] == names
        np.testing.assert_allclose(
            list(point_cloud2.read_points(ours)), np.array(rows, float), rtol=1e-6, atol=2e-6
        )
