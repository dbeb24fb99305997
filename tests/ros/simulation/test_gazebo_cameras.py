"""Plugins of cameras: pictures, depths and points against geometry, with real processes."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from gazebo_msgs.srv import DeleteModel, SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from sensor_msgs.srv import SetCameraInfo

from minirospy import Node
from tests.ros.simulation.processes import Start, call, end, run, start_world, until, written

WIDTH, HEIGHT, FOV = 80, 60, math.radians(60)
FOCAL = WIDTH / (2 * math.tan(FOV / 2))
UP = Quaternion(0.0, 0.0, 0.0, 1.0)
BOX = """<sdf version="1.6"><model name="box"><static>true</static><link name="link"><visual name="v">
  <geometry><box><size>1 1 1</size></box></geometry>
  <material><ambient>1 0 0 1</ambient><diffuse>1 0 0 1</diffuse></material></visual></link></model></sdf>"""
OPTICS = f"""<horizontal_fov>{FOV}</horizontal_fov><image><width>{WIDTH}</width><height>{HEIGHT}</height>
  <format>R8G8B8</format></image><clip><near>0.05</near><far>20</far></clip>"""


WALL = BOX.replace("1 1 1</size>", "0.2 20 20</size>").replace('name="box"', 'name="wall"')


def eye(kind: str, library: str, parameters: str, cameras: str = f"<camera>{OPTICS}</camera>") -> str:
    """Return a static model whose camera is 1 m above its origin."""
    return f"""<sdf version="1.6"><model name="eye"><static>true</static><link name="link">
      <sensor name="camera" type="{kind}"><pose>0 0 1 0 0 0</pose><update_rate>20</update_rate>{cameras}
      <plugin name="eye" filename="lib{library}.so">{parameters}</plugin></sensor></link></model></sdf>"""


async def spawn(node: Node, name: str, xml: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
    arguments = (name, xml, "", Pose(Point(x, y, z), UP), "")
    response = await call(node, "spawn_sdf_model", SpawnModel, *arguments)
    assert response.success, response.status_message


def pixels(image: Image) -> NDArray[np.uint8]:
    return np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, -1)


def is_red(color: Any) -> bool:
    red, green, blue = (int(each) for each in color)
    return red > 60 and green < 20 and blue < 20


@pytest.fixture
def _opengl() -> None:
    from minirospy.ros.gazebo_ros.physics import Simulation, SimulationError

    try:
        Simulation().open_renderer(8, 8).close()
    except SimulationError as error:
        pytest.skip(str(error))


@pytest.mark.usefixtures("_opengl")
def test_a_camera_sees_a_red_box(master: str, start: Start) -> None:
    process = start_world(start)
    camera = eye("camera", "gazebo_ros_camera", "<cameraName>cam</cameraName><frameName>/lens</frameName>")

    async def body(node: Node) -> None:
        await spawn(node, "box", BOX, 2.5, 0.0, 1.0)
        await spawn(node, "eye", camera)
        image = await until(node, "/cam/image_raw", Image, lambda each: is_red(pixels(each)[30, 40]))
        assert (image.width, image.height, image.encoding, image.step) == (WIDTH, HEIGHT, "rgb8", 3 * WIDTH)
        assert image.header.frame_id == "lens"
        # The face is 1 m wide at 2 m.
        width = sum(is_red(color) for color in pixels(image)[30])
        assert abs(width - FOCAL / 2) <= 1
        assert not is_red(pixels(image)[30, 2])

        info = await until(node, "/cam/camera_info", CameraInfo, lambda _: True)
        assert info.header.frame_id == "lens"
        assert pytest.approx([FOCAL, 0, (WIDTH + 1) / 2, 0, FOCAL, (HEIGHT + 1) / 2, 0, 0, 1]) == info.K

        changed = CameraInfo(width=1)
        assert (await node.call("/cam/set_camera_info", SetCameraInfo, changed)).success
        await until(node, "/cam/camera_info", CameraInfo, lambda each: each.width == 1)
        assert (await call(node, "delete_model", DeleteModel, "eye")).success
        await spawn(node, "eye", camera)
        await until(node, "/cam/image_raw", Image, lambda each: is_red(pixels(each)[30, 40]))

    run(body)
    output, errors = end(process)
    assert process.returncode == 0, output + errors


@pytest.mark.usefixtures("_opengl")
def test_a_texture_that_cannot_be_read_is_named(master: str, start: Start, tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    broken = written(tmp_path, "broken.png", "no picture")
    box = BOX.replace("<ambient>", f"<pbr><metal><albedo_map>{broken}</albedo_map></metal></pbr><ambient>")
    process = start_world(start)

    async def body(node: Node) -> None:
        await spawn(node, "box", box, 2.5, 0.0, 1.0)
        await spawn(node, "eye", eye("camera", "gazebo_ros_camera", "<cameraName>cam</cameraName>"))
        await until(node, "/cam/image_raw", Image, lambda each: is_red(pixels(each)[30, 40]))

    run(body)
    output, errors = end(process)
    assert (output + errors).count(f"model 'box': the picture {broken} is not shown: ") == 1


@pytest.mark.usefixtures("_opengl")
def test_pictures_come_at_the_lower_rate_of_sensor_and_plugin(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        plugin = "<cameraName>cam</cameraName><updateRate>10</updateRate>"
        await spawn(node, "eye", eye("camera", "gazebo_ros_camera", plugin))
        stamps: list[float] = []
        async for image in node.subscribe("/cam/image_raw", Image):
            stamps.append(image.header.stamp.to_sec())
            if len(stamps) == 6:
                break
        # A slow computer skips pictures: each stamp is a multiple of the period after the first one.
        periods = np.diff(stamps) / 0.1
        assert periods == pytest.approx(np.round(periods), abs=0.05)
        assert periods.min() > 0.9

        config = Config(doubles=[DoubleParameter("imager_rate", 4.0)])
        response = await node.call("/cam/set_parameters", Reconfigure, config)
        assert response.config.doubles[0].value == 4.0
        last = 0.0
        async for image in node.subscribe("/cam/image_raw", Image):
            last, before = image.header.stamp.to_sec(), last
            if before and last - before > 0.24:
                break

    run(body)


@pytest.mark.usefixtures("_opengl")
def test_a_depth_camera_measures_the_geometry(master: str, start: Start) -> None:
    start_world(start)
    parameters = """<cameraName>kinect</cameraName><frameName>optical</frameName>
      <imageTopicName>rgb/image_raw</imageTopicName><pointCloudCutoffMax>4</pointCloudCutoffMax>"""

    async def body(node: Node) -> None:
        await spawn(node, "box", BOX, 2.5, 0.0, 1.0)
        await spawn(node, "eye", eye("depth", "gazebo_ros_openni_kinect", parameters))

        def depths(image: Image) -> NDArray[np.float32]:
            return np.frombuffer(image.data, "<f4").reshape(image.height, image.width)

        image = await until(node, "/kinect/depth/image_raw", Image, lambda _: True)
        assert (image.encoding, image.step, image.header.frame_id) == ("32FC1", 4 * WIDTH, "optical")
        assert depths(image)[30, 40] == pytest.approx(2.0, abs=0.002)
        # A pixel below the middle sees the ground, 1 m below.
        row = 55
        ground = FOCAL / (row - 29.5)
        step = FOCAL / (row - 29.5 - 0.5) - ground
        assert depths(image)[row, 5] == pytest.approx(ground, abs=step)
        assert math.isnan(depths(image)[0, 0])  # the sky is farther than the limit

        cloud = await until(node, "/kinect/points", PointCloud2, lambda _: True)
        assert (cloud.width, cloud.height, cloud.point_step) == (WIDTH, HEIGHT, 32)
        assert [(each.name, each.offset) for each in cloud.fields] == [
            ("x", 0),
            ("y", 4),
            ("z", 8),
            ("rgb", 16),
        ]
        assert not cloud.is_dense
        at = (30 * WIDTH + 50) * 32
        x, y, z = struct.unpack_from("<3f", cloud.data, at)
        # Optical axes: x to the right, y down, z forward.
        assert (x, y, z) == pytest.approx((2 * 10.5 / FOCAL, 2 * 0.5 / FOCAL, 2.0), abs=0.003)
        first, second, third = cloud.data[at + 16 : at + 19]
        assert is_red((first, second, third))
        await until(node, "/kinect/rgb/image_raw", Image, lambda each: is_red(pixels(each)[30, 40]))
        for topic in ("depth/camera_info", "ir/camera_info"):
            info = await until(node, f"/kinect/{topic}", CameraInfo, lambda _: True)
            assert info.K[0] == pytest.approx(FOCAL)

    run(body)


@pytest.mark.usefixtures("_opengl")
def test_a_wall_is_flat(master: str, start: Start) -> None:
    start_world(start)
    parameters = "<cameraName>wide</cameraName><imageTopicName>image_raw</imageTopicName>"

    async def body(node: Node) -> None:
        await spawn(node, "wall", WALL, 2.1, 0.0, 1.0)
        await spawn(node, "eye", eye("depth", "gazebo_ros_openni_kinect", parameters))
        image = await until(node, "/wide/image_raw", Image, lambda _: True)
        assert is_red(pixels(image)[30, 40])
        depth = await until(node, "/wide/depth/image_raw", Image, lambda _: True)
        depths = np.frombuffer(depth.data, "<f4").reshape(HEIGHT, WIDTH)
        # The distance along the axis is the same at the side.
        assert (depths[30, 40], depths[30, 75]) == pytest.approx((2.0, 2.0), abs=0.01)
        cloud = await until(node, "/wide/points", PointCloud2, lambda _: True)
        points = np.frombuffer(cloud.data, "<f4").reshape(HEIGHT, WIDTH, 8)
        assert points[30, 75, :3] == pytest.approx((35.5 * 2 / FOCAL, 0.5 * 2 / FOCAL, 2.0), abs=0.02)

    run(body)


@pytest.mark.usefixtures("_opengl")
def test_depths_in_millimetres(master: str, start: Start) -> None:
    start_world(start)
    parameters = """<cameraName>d</cameraName><pointCloudCutoff>0.1</pointCloudCutoff>
      <useDepth16UC1Format>true</useDepth16UC1Format>"""

    async def body(node: Node) -> None:
        await spawn(node, "box", BOX, 2.5, 0.0, 1.0)
        await spawn(node, "eye", eye("depth", "gazebo_ros_depth_camera", parameters))
        image = await until(node, "/d/depth/image_raw", Image, lambda _: True)
        assert (image.encoding, image.step) == ("16UC1", 2 * WIDTH)
        depths = np.frombuffer(image.data, "<u2").reshape(HEIGHT, WIDTH)
        assert abs(int(depths[30, 40]) - 2000) <= 2
        assert depths[0, 0] in (19999, 20000)  # the far limit of the camera
        cloud = await until(node, "/d/points", PointCloud2, lambda _: True)
        assert (cloud.width, cloud.height) == (WIDTH * HEIGHT, 1)

    run(body)


@pytest.mark.usefixtures("_opengl")
def test_two_cameras_see_a_disparity(master: str, start: Start) -> None:
    start_world(start)
    cameras = f"""<camera name="left">{OPTICS}</camera>
      <camera name="right"><pose>0 -0.2 0 0 0 0</pose>{OPTICS}</camera>"""
    parameters = "<cameraName>stereo</cameraName><hackBaseline>0.2</hackBaseline>"

    async def body(node: Node) -> None:
        await spawn(node, "box", BOX, 2.5, 0.0, 1.0)
        await spawn(node, "eye", eye("multicamera", "gazebo_ros_multicamera", parameters, cameras))
        edges = {}
        for side in ("left", "right"):
            image = await until(node, f"/stereo/{side}/image_raw", Image, lambda _: True)
            edges[side] = next(i for i, color in enumerate(pixels(image)[30]) if is_red(color))
        assert abs(edges["left"] - edges["right"] - FOCAL * 0.2 / 2) <= 1
        left = await until(node, "/stereo/left/camera_info", CameraInfo, lambda _: True)
        right = await until(node, "/stereo/right/camera_info", CameraInfo, lambda _: True)
        assert (left.P[3], right.P[3]) == pytest.approx((0.0, -FOCAL * 0.2))

    run(body)


def test_without_opengl_one_warning_names_the_remedy(
    master: str, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    monkeypatch.setenv("PYOPENGL_PLATFORM", "nonsense")
    process = start_world(start)

    async def body(node: Node) -> None:
        for name in ("one", "two"):
            camera = eye("camera", "gazebo_ros_camera", f"<cameraName>{name}</cameraName>")
            await spawn(node, name, camera.replace('name="eye"', f'name="{name}"', 1))
        async with node.subscribe("/one/image_raw", Image), node.subscribe("/two/image_raw", Image):
            for name in ("one", "two", "one", "two"):
                await until(node, f"/{name}/camera_info", CameraInfo, lambda _: True)

    run(body)
    output, errors = end(process)
    text = output + errors
    assert text.count("cameras publish no pictures: cameras need OpenGL: ") == 1, text
