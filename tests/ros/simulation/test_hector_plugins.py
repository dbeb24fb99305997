"""Sensors of hector_gazebo_plugins, with real processes."""

from __future__ import annotations

import math

import pytest
from gazebo_msgs.srv import SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion
from sensor_msgs.msg import Imu, NavSatFix, Range

from minirospy import Node
from tests.ros.simulation.processes import Start, call, run, start_world, until

WALL = """<sdf version="1.6"><model name="wall"><static>true</static><link name="link">
  <collision name="wall"><geometry><box><size>0.2 20 20</size></box></geometry></collision></link></model></sdf>"""
DRONE = """<sdf version="1.6"><model name="drone"><static>true</static><link name="body">
  <sensor type="ray" name="sonar"><ray><scan><horizontal><samples>3</samples>
    <min_angle>-0.1</min_angle><max_angle>0.1</max_angle></horizontal></scan>
    <range><min>0.1</min><max>5</max></range></ray>
    <plugin name="sonar" filename="libhector_gazebo_ros_sonar.so"/></sensor></link>
  <plugin name="imu" filename="libhector_gazebo_ros_imu.so"><accelOffset>0.5 0 0</accelOffset>
    <rateGaussianNoise>0.1 0.1 0.2</rateGaussianNoise></plugin>
  <plugin name="gps" filename="libhector_gazebo_ros_gps.so"><referenceLatitude>0</referenceLatitude>
    <referenceLongitude>10</referenceLongitude><referenceAltitude>100</referenceAltitude>
    <offset>0 0 2</offset></plugin></model></sdf>"""


def test_sensors_of_a_drone(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        for name, xml, x in (("wall", WALL, 23.0), ("drone", DRONE, 20.0)):
            arguments = (name, xml, "", Pose(Point(x, -30.0, 5.0), Quaternion(0.0, 0.0, 0.0, 1.0)), "")
            assert (await call(node, "spawn_sdf_model", SpawnModel, *arguments)).success

        sonar = await until(node, "/sonar", Range, lambda _: True)
        assert (sonar.header.frame_id, sonar.range) == ("sonar_link", pytest.approx(2.9, abs=1e-3))

        # x points to the north, y to the west. At the equator a degree of longitude is 111.32 km, one of latitude 110.57 km.
        fix = await until(node, "/fix", NavSatFix, lambda _: True)
        assert fix.latitude == pytest.approx(20 / 110574.3, rel=1e-4)
        assert fix.longitude - 10 == pytest.approx(30 / 111319.5, rel=1e-4)
        assert fix.altitude == pytest.approx(107.0)

        imu = await until(node, "/imu", Imu, lambda _: True)
        assert imu.header.frame_id == "body"
        acceleration = imu.linear_acceleration
        assert (acceleration.x, acceleration.z) == pytest.approx((0.5, 9.8))
        assert imu.angular_velocity_covariance[::4] == pytest.approx((0.01, 0.01, 0.04))
        # The accelerometer's error tilts the estimated orientation.
        assert imu.orientation.y == pytest.approx(-math.sin(0.5 / 9.8 / 2), rel=0.01)
        bias = await until(node, "/imu/bias", Imu, lambda _: True)
        assert bias.linear_acceleration.x == 0.5

    run(body)
