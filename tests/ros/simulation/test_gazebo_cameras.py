"""Cameras: pictures and depths against the geometry, with real processes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gazebo_msgs.srv import SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

from minirospy import Node
from tests.ros.simulation.processes import Start, call, run, start_world, until

UP = Quaternion(0.0, 0.0, 0.0, 1.0)
CAMERA = """<sdf version="1.6"><model name="eye"><static>true</static><link name="link">
  <sensor type="depth" name="eye"><update_rate>10</update_rate>
    <camera><horizontal_fov>1.0</horizontal_fov>
      <image><width>160</width><height>120</height><format>R8G8B8</format></image>
      <clip><near>0.05</near><far>50</far></clip></camera>
    <plugin name="eye" filename="libgazebo_ros_openni_kinect.so">
      <cameraName>eye</cameraName><frameName>optical</frameName></plugin>
  </sensor></link></model></sdf>"""
WALL = """<sdf version="1.6"><model name="wall"><static>true</static><link name="link">
  <visual name="wall"><geometry><box><size>0.2 20 20</size></box></geometry>
    <material><ambient>1 0 0 1</ambient><diffuse>1 0 0 1</diffuse></material></visual></link></model></sdf>"""


@pytest.fixture(autouse=True)
def _needs_opengl() -> None:
    from minirospy.ros.gazebo_ros.physics import SimulationError
    from minirospy.ros.gazebo_ros.physics.rendering import open_context

    try:
        _, context = open_context(8, 8)
    except SimulationError as error:
        pytest.skip(str(error))
    context.free()


def test_a_depth_camera_sees_a_wall(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        for name, text, x in (("eye", CAMERA, 0.0), ("wall", WALL, 2.1)):
            arguments = (name, text, "/", Pose(Point(x, 0.0, 1.0), UP), "")
            assert (await call(node, "spawn_sdf_model", SpawnModel, *arguments)).success

        image = await until(node, "/eye/image_raw", Image, lambda _: True)
        assert (image.width, image.height, image.encoding, image.step) == (160, 120, "rgb8", 480)
        assert image.header.frame_id == "optical"
        pixels = np.frombuffer(image.data, np.uint8).reshape(120, 160, 3)
        red, green, _ = pixels[60, 80].astype(int)
        assert red > green + 50

        info = await until(node, "/eye/camera_info", CameraInfo, lambda _: True)
        assert math.isclose(info.K[0], 160 / (2 * math.tan(0.5)))
        depth = await until(node, "/eye/depth/image_raw", Image, lambda _: True)
        depths = np.frombuffer(depth.data, np.float32).reshape(120, 160)
        assert math.isclose(depths[60, 80], 2.0, abs_tol=0.01)
        # The distance along the axis is the same at the side.
        assert math.isclose(depths[60, 150], 2.0, abs_tol=0.01)
        cloud = await until(node, "/eye/points", PointCloud2, lambda _: True)
        points = np.frombuffer(cloud.data, np.float32).reshape(120, 160, 8)
        x, y, z = points[60, 150, :3]
        assert math.isclose(z, 2.0, abs_tol=0.01)
        assert math.isclose(x, 70.5 / info.K[0] * 2, abs_tol=0.02)
        assert abs(y) < 0.02

    run(body)
