"""libgazebo_ros_velodyne_laser.so against geometry, with real processes."""

from __future__ import annotations

import numpy as np
import pytest
from gazebo_msgs.srv import SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from minirospy import Node
from tests.ros.simulation.processes import Start, call, run, start_world, until

UP = Quaternion(0.0, 0.0, 0.0, 1.0)
WALL = """<sdf version="1.6"><model name="wall"><static>true</static><link name="link">
  <collision name="wall"><geometry><box><size>0.2 20 20</size></box></geometry></collision></link></model></sdf>"""
ROWS, COLUMNS = 16, 361
# The housing is nearer than the rays' minimum.
SCANNER = """<sdf version="1.6"><model name="scanner"><static>true</static><link name="link">
  <collision name="housing"><geometry><cylinder><radius>0.05</radius><length>0.07</length></cylinder></geometry></collision>
  <sensor type="gpu_ray" name="rays"><update_rate>20</update_rate><ray>
    <scan><horizontal><samples>361</samples><min_angle>-3.14159265</min_angle><max_angle>3.14159265</max_angle></horizontal>
      <vertical><samples>16</samples><min_angle>-0.26179939</min_angle><max_angle>0.26179939</max_angle></vertical></scan>
    <range><min>0.3</min><max>6</max></range></ray>
    <plugin name="points" filename="libgazebo_ros_velodyne{}_laser.so">
      <topicName>points</topicName><frameName>/velodyne</frameName>{}</plugin></sensor></link></model></sdf>"""
DTYPE = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring", "time"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<f4"],
        "offsets": [0, 4, 8, 12, 16, 18],
        "itemsize": 22,
    }
)


def points_of(cloud: PointCloud2) -> NDArray[np.void]:
    return np.frombuffer(cloud.data, DTYPE)


def positions(points: NDArray[np.void]) -> NDArray[np.float64]:
    return np.stack([points[axis].astype(float) for axis in "xyz"], axis=-1)


async def scan(node: Node, suffix: str, parameters: str, namespace: str = "") -> PointCloud2:
    """Return a cloud of a scanner at z = 0.5, two metres in front of a wall."""
    for name, xml, x, z in (
        ("wall", WALL, 2.1, 0.0),
        ("scanner", SCANNER.format(suffix, parameters), 0.0, 0.5),
    ):
        arguments = (name, xml, namespace, Pose(Point(x, 0.0, z), UP), "")
        response = await call(node, "spawn_sdf_model", SpawnModel, *arguments)
        assert response.success, response.status_message
    topic = f"{namespace}/points"
    return await until(node, topic, PointCloud2, lambda _: True)


@pytest.mark.parametrize("suffix", ["", "_gpu"])
def test_points_lie_on_the_wall_and_on_the_ground(master: str, start: Start, suffix: str) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        cloud = await scan(node, suffix, "<min_range>0.9</min_range>")
        assert [(each.name, each.offset, each.datatype, each.count) for each in cloud.fields] == [
            ("x", 0, PointField.FLOAT32, 1),
            ("y", 4, PointField.FLOAT32, 1),
            ("z", 8, PointField.FLOAT32, 1),
            ("intensity", 12, PointField.FLOAT32, 1),
            ("ring", 16, PointField.UINT16, 1),
            ("time", 18, PointField.FLOAT32, 1),
        ]
        points = points_of(cloud)
        assert (cloud.height, cloud.width, cloud.point_step) == (1, len(points), 22)
        assert (cloud.row_step, cloud.is_dense, cloud.is_bigendian) == (22 * len(points), True, False)
        assert cloud.header.frame_id == "velodyne"
        x, _, z = positions(points).T
        on_wall, on_ground = abs(x - 2.0) < 1e-3, abs(z + 0.5) < 1e-3
        assert (on_wall | on_ground).all()
        assert on_wall.sum() > 500
        assert on_ground.sum() > 500
        assert not points["intensity"].any()
        assert not points["time"].any()
        # Ring j has the elevation -15 + 2 j degrees.
        distances = np.linalg.norm(positions(points), axis=1)
        assert np.degrees(np.arcsin(z / distances)) == pytest.approx(-15.0 + 2.0 * points["ring"], abs=0.01)
        assert distances.min() == pytest.approx(0.5 / np.sin(np.radians(15.0)), abs=1e-3)
        assert distances.max() < 6.0
        # All rows of a direction follow each other.
        azimuths = np.arctan2(positions(points)[:, 1], x)
        assert (np.diff(azimuths) > -1e-4).all()

    run(body)


def test_an_organized_cloud_has_a_row_for_each_direction(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        cloud = await scan(node, "", "<organize_cloud>true</organize_cloud><max_range>4</max_range>", "/r")
        assert (cloud.height, cloud.width, cloud.row_step) == (COLUMNS, ROWS, 22 * ROWS)
        assert not cloud.is_dense
        assert cloud.header.frame_id == "velodyne"  # a name with a slash at its start gets no prefix
        points = points_of(cloud).reshape(COLUMNS, ROWS)
        assert (points["ring"] == np.arange(ROWS)).all()
        ahead = positions(points)[COLUMNS // 2]
        elevations = np.radians(-15.0 + 2.0 * np.arange(ROWS))
        assert ahead[:, 1] == pytest.approx(0.0, abs=1e-5)
        wall = slice(1, ROWS)  # the lowest ray meets the ground before the wall
        assert ahead[wall, 0] == pytest.approx(2.0, abs=1e-3)
        assert ahead[wall, 2] == pytest.approx(2.0 * np.tan(elevations[wall]), abs=1e-3)
        behind = points[0]
        assert behind["z"][0] == pytest.approx(-0.5, abs=1e-3)
        assert np.isnan(positions(behind)[8:]).all()
        assert np.isnan(behind["intensity"][8:]).all()
        assert not behind["time"].any()

    run(body)


def test_noise_and_the_minimum_of_intensities(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        cloud = await scan(node, "", "<gaussianNoise>0.05</gaussianNoise>")
        points = positions(points_of(cloud))
        ahead = points[(abs(points[:, 1]) < 0.5) & (points[:, 0] > 1.7) & (points[:, 2] > -0.2)]
        assert 0.03 < np.std(ahead[:, 0]) < 0.07
        assert np.mean(ahead[:, 0]) == pytest.approx(2.0, abs=0.02)
        xml = SCANNER.format("", "<min_intensity>1</min_intensity>").replace(
            "<topicName>points</topicName><frameName>/", "<topicName>none</topicName><frameName>"
        )
        arguments = ("dim", xml, "/r", Pose(Point(0.0, 0.0, 0.5), UP), "")
        assert (await call(node, "spawn_sdf_model", SpawnModel, *arguments)).success
        empty = await until(node, "/r/none", PointCloud2, lambda _: True)
        assert empty.header.frame_id == "r/velodyne"
        assert (empty.width, empty.height, len(empty.data)) == (0, 1, 0)

    run(body)
