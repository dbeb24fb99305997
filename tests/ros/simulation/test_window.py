"""The topics of the simulation's window, of a real gzserver."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import DeleteModel, GetWorldProperties, SetModelState, SpawnModel
from geometry_msgs.msg import Pose
from sensor_msgs.msg import JointState
from std_msgs.msg import UInt32
from std_srvs.srv import Empty, Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from minirospy import Node
from minirospy.core.sdf.model import Box, World
from minirospy.ros.gazebo_ros.physics import Simulation, State
from minirospy.ros.gazebo_ros.server import Server
from minirospy.ros.gazebo_ros.window import model_names, ray_lengths
from minirospy.runtime.rpc.master_proxy import MasterProxy, SlaveProxy
from tests.ros.simulation.processes import (
    BOX,
    Start,
    call,
    connected,
    first_of,
    run,
    start_world,
    until,
    written,
)
from tests.ros.simulation.worlds import at as pose
from tests.ros.simulation.worlds import still

ROVER = Path(__file__).with_name("rover.urdf").read_text(encoding="utf-8")


def at(x: float = 0.0, z: float = 0.0) -> Pose:
    pose = Pose()
    pose.position.x, pose.position.z, pose.orientation.w = x, z, 1.0
    return pose


def messages_received(master: str, topic: str) -> int:
    """Return how many messages of a topic the simulation has received."""
    with contextlib.closing(MasterProxy(master, "/test")) as graph:
        uri = graph.lookup_node("/gazebo")
    with contextlib.closing(SlaveProxy(uri, "/test")) as simulation:
        _, subscriptions, _ = cast(Any, simulation.get_bus_stats())
    return sum(row[2] for name, rows in subscriptions if name == topic for row in rows)


async def spawn(node: Node, text: str, name: str, pose: Pose, *, kind: str = "urdf") -> None:
    response = await call(node, f"spawn_{kind}_model", SpawnModel, name, text, "", pose, "world")
    assert response.success, response.status_message


def names(message: MarkerArray) -> list[str]:
    return [marker.ns for marker in message.markers if marker.action == Marker.ADD]


def test_shapes_are_those_of_the_models_that_exist(master: str, start: Start) -> None:
    start_world(start, "-u")

    async def body(node: Node) -> None:
        await spawn(node, BOX, "box", at(z=5))
        message = await until(node, "/gazebo/window/shapes", MarkerArray, lambda each: len(each.markers) == 3)
        clear, ground, box = message.markers
        assert clear.action == Marker.DELETEALL
        # A static model is where it is; another one is in the frame of its link, which moves.
        assert (ground.ns, ground.header.frame_id, ground.frame_locked) == (
            "ground_plane::link",
            "world",
            False,
        )
        assert (box.header.frame_id, box.frame_locked, box.pose.position.z) == ("box::base_link", True, 0.0)
        await call(node, "delete_model", DeleteModel, "box")
        await until(
            node, "/gazebo/window/shapes", MarkerArray, lambda each: names(each) == ["ground_plane::link"]
        )
        await spawn(node, BOX, "box", at(z=2))
        await until(node, "/gazebo/window/shapes", MarkerArray, lambda each: len(names(each)) == 2)

    run(body)


def test_a_moved_static_model_is_shown_there(master: str, start: Start) -> None:
    start_world(start, "-u")
    static = BOX.replace("</robot>", "<gazebo><static>true</static></gazebo></robot>")

    async def body(node: Node) -> None:
        await spawn(node, static, "wall", at())
        state = ModelState(model_name="wall", pose=at(x=3))
        assert (await call(node, "set_model_state", SetModelState, state)).success
        await until(
            node,
            "/gazebo/window/shapes",
            MarkerArray,
            lambda each: (
                [marker.pose.position.x for marker in each.markers if marker.ns == "wall::base_link"] == [3]
            ),
        )
        await call(node, "reset_world", Empty)
        await until(
            node,
            "/gazebo/window/shapes",
            MarkerArray,
            lambda each: (
                [marker.pose.position.x for marker in each.markers if marker.ns == "wall::base_link"] == [0]
            ),
        )

    run(body)


def test_poses_follow_what_moves_and_forget_what_is_deleted(master: str, start: Start) -> None:
    start_world(start, "-u")

    async def body(node: Node) -> None:
        await spawn(node, BOX, "box", at(z=20))
        heights: list[float] = []

        def is_fallen(message: TFMessage) -> bool:
            assert {each.header.frame_id for each in message.transforms} <= {"world"}
            heights.extend(
                each.transform.translation.z
                for each in message.transforms
                if each.child_frame_id == "box::base_link"
            )
            return bool(heights) and heights[-1] < 0.55

        # Subscribe before the box falls: on a busy machine it may land before a subscription is connected.
        poses = await connected(node, "/gazebo/window/poses", TFMessage)
        # A paused world is shown, too.
        await first_of(poses, lambda each: not is_fallen(each) and bool(heights))
        assert heights == [pytest.approx(20)]
        await call(node, "unpause_physics", Empty)
        await first_of(poses, is_fallen)
        assert len(heights) > 5
        await call(node, "delete_model", DeleteModel, "box")
        await first_of(poses, lambda each: not each.transforms)

    run(body)


def test_state_and_steps_of_a_paused_world(master: str, start: Start) -> None:
    start_world(start, "-u")

    async def body(node: Node) -> None:
        def values(message: DiagnosticStatus) -> dict[str, float]:
            return {each.key: float(each.value) for each in message.values}

        first = await until(node, "/gazebo/window/state", DiagnosticStatus, lambda each: True)
        assert (first.name, first.message) == ("default", "paused")
        assert values(first)["max_update_rate"] == 1000
        steps = await node.advertise("/gazebo/window/step", UInt32)
        await steps.wait_for_subscribers()
        await steps.publish(UInt32(250))
        expected = pytest.approx(values(first)["time"] + 0.25)
        await until(
            node, "/gazebo/window/state", DiagnosticStatus, lambda each: values(each)["time"] == expected
        )
        # While it runs, steps are not added.
        await call(node, "unpause_physics", Empty)
        await until(node, "/gazebo/window/state", DiagnosticStatus, lambda each: each.message == "running")
        await steps.publish(UInt32(1_000_000))
        # A service overtakes a topic on a busy machine. Once the next message is counted, this one has been handled.
        await steps.publish(UInt32(0))
        while await asyncio.to_thread(messages_received, master, "/gazebo/window/step") < 3:
            pass
        await call(node, "pause_physics", Empty)
        stopped = (await call(node, "get_world_properties", GetWorldProperties)).sim_time
        await steps.publish(UInt32(10))
        expected = pytest.approx(stopped + 0.01)
        await until(
            node, "/gazebo/window/state", DiagnosticStatus, lambda each: values(each)["time"] == expected
        )
        assert stopped < 100

    run(body)


def test_joints_contacts_and_rays(master: str, start: Start, tmp_path: Path) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await spawn(node, ROVER, "rover", at(z=0.02))
        await spawn(node, BOX, "box", at(x=2, z=0.5))
        joints = await until(
            node, "/gazebo/window/joints", JointState, lambda each: "rover::left_joint" in each.name
        )
        assert len(joints.name) == len(joints.position) == len(joints.velocity) == len(joints.effort)

        # The four corners of the box, and the rover's wheels and casters, are on the ground.
        contacts = await until(
            node, "/gazebo/window/contacts", MarkerArray, lambda each: len(each.markers[0].points) >= 8
        )
        points, normals = contacts.markers
        assert len(normals.points) == 2 * len(points.points)
        assert all(abs(point.z) < 0.01 for point in points.points)
        assert all(
            abs(abs(end.z - begin.z) - 0.12) < 1e-3
            for begin, end in zip(normals.points[::2], normals.points[1::2], strict=True)
        )

        def has_hit(message: MarkerArray) -> bool:
            lines = [each for each in message.markers if each.ns.endswith("::scanner")]
            # The ray forwards ends at the box.
            return bool(lines) and any(
                abs(point.y) < 0.03 and abs(point.x - 1.5) < 0.1 for point in lines[0].points
            )

        rays = await until(node, "/gazebo/window/rays", MarkerArray, has_hit)
        assert all(len(each.points) <= 2 * 360 for each in rays.markers)

    run(body)


def test_library_lists_its_models(
    master: str, start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my_hut").mkdir()
    written(tmp_path / "my_hut", "model.config", "<model><name>my_hut</name></model>")
    (tmp_path / "no_model").mkdir()
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(tmp_path))
    start_world(start, "-u")

    async def body(node: Node) -> None:
        found = (await call(node, "window/list_models", Trigger)).message.split("\n")
        assert {"my_hut", "table", "unit_box"} <= set(found)
        assert "no_model" not in found
        sdf = "<sdf version='1.6'><include><uri>model://table</uri></include></sdf>"
        await spawn(node, sdf, "my_table", at(), kind="sdf")
        properties = await call(node, "get_world_properties", GetWorldProperties)
        assert properties.model_names == ["ground_plane", "my_table"]

    run(body)


def test_a_folder_that_cannot_be_read_hides_no_other_models(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("hut", "secret"):
        (tmp_path / name).mkdir()
        written(tmp_path / name, "model.config", "<model/>")
    stat = os.stat

    def refuse(path: Any, **options: Any) -> os.stat_result:
        if Path(path).parent.name == "secret":
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return stat(path, **options)

    monkeypatch.setattr(os, "stat", refuse)
    assert "hut" in model_names([str(tmp_path)])


def test_rays_of_infinite_range_are_drawn_with_finite_lengths() -> None:
    distances = np.array([2.0, 8.0, 150.0, np.inf])
    assert ray_lengths(distances, np.inf).tolist() == [2, 8, 150, 100]
    assert ray_lengths(distances, 5.0).tolist() == [2, 5, 5, 5]
    assert ray_lengths(distances, 500.0).tolist() == [2, 8, 150, 500]


def test_a_static_model_that_stays_is_not_shown_again() -> None:
    simulation = Simulation(World(models=(still("wall", Box((1.0, 1.0, 1.0))),)))
    wall, changes = simulation.model("wall"), []
    server: Any = SimpleNamespace(
        loop=SimpleNamespace(simulation=simulation, is_paused=False),
        _window=SimpleNamespace(changed=lambda: changes.append(wall.pose.position[0])),
    )
    for x in (0.0, 1.0, 1.0, 2.0):
        before = wall.pose
        wall.set_state(State(pose(x, yaw=0.3)))
        Server.moved(server, "wall", before)
    assert changes == [0, 1, 2]  # the first one turns it
