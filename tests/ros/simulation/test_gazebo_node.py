"""The node /gazebo: its services, topics and /clock, and spawn_model."""

from __future__ import annotations

import asyncio
import math
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from gazebo_msgs.msg import LinkStates, ModelState, ModelStates, ODEJointProperties
from gazebo_msgs.srv import (
    ApplyBodyWrench,
    ApplyJointEffort,
    BodyRequest,
    DeleteModel,
    GetJointProperties,
    GetLinkProperties,
    GetLinkState,
    GetModelProperties,
    GetModelState,
    GetPhysicsProperties,
    GetWorldProperties,
    SetJointProperties,
    SetLinkProperties,
    SetLinkState,
    SetModelConfiguration,
    SetModelState,
    SetPhysicsProperties,
    SpawnModel,
)
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3, Wrench
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty
from visualization_msgs.msg import MarkerArray

from minirospy import Node
from minirospy.base.errors import ServiceException
from minirospy.base.times import Duration, Time
from minirospy.workspace.packages import Packages
from tests.ros.robot_state_publisher.conftest import SECONDS
from tests.ros.simulation.processes import BOX, Start, call, end, run, start_world, until, written

UP = Quaternion(0.0, 0.0, 0.0, 1.0)
ARM = """<robot name="arm">
  <link name="world"/>
  <joint name="fix" type="fixed"><parent link="world"/><child link="base"/></joint>
  <link name="base"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="hinge" type="continuous"><axis xyz="0 0 1"/><parent link="base"/><child link="tip"/></joint>
  <link name="tip"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
</robot>"""


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    return Pose(Point(x, y, z), UP)


async def spawn(node: Node, text: str, name: str, pose: Pose, frame: str = "") -> tuple[bool, str]:
    response = await call(node, "spawn_urdf_model", SpawnModel, name, text, "/", pose, frame)
    return response.success, response.status_message


def test_a_robot_from_a_launch_file_falls_and_rests(master: str, tmp_path: Path, launch: Start) -> None:
    urdf = written(tmp_path, "box.urdf", '\n<?xml version="1"?>\n' + BOX)
    file = written(
        tmp_path,
        "box.launch",
        f"""<launch>
          <include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="gui" value="false"/></include>
          <param name="robot_description" textfile="{urdf}"/>
          <node name="spawn" pkg="gazebo_ros" type="spawn_model" output="screen"
                args="-urdf -param robot_description -model box -x 1 -z 2"/>
        </launch>""",
    )
    process = launch(file)

    async def body(node: Node) -> None:
        def rests(states: ModelStates) -> bool:
            if "box" not in states.name:
                return False
            return abs(states.pose[states.name.index("box")].position.z - 0.5) < 1e-3

        states = await until(node, "/gazebo/model_states", ModelStates, rests)
        assert states.name == ["ground_plane", "box"]
        assert abs(states.pose[1].position.x - 1) < 1e-3
        assert await node.get_param("/use_sim_time") is True

    run(body)
    output, _ = end(process)
    assert "Spawn status: SpawnModel: Successfully spawned entity" in output


def test_services_answer_with_the_texts_of_ros(master: str, start: Start) -> None:
    start_world(start, "-u")

    async def body(node: Node) -> None:
        assert await spawn(node, BOX, "box", at(z=5)) == (True, "SpawnModel: Successfully spawned entity")
        assert await spawn(node, BOX, "box", at()) == (False, "SpawnModel: Failure - entity already exists.")
        lost = (
            "SpawnModel: reference reference_frame not found, did you forget to scope the link by model name?"
        )
        assert await spawn(node, BOX, "other", at(), "nowhere") == (False, lost)
        assert (await spawn(node, BOX, "other", at(x=1), "box::base_link"))[0]
        with pytest.raises(ServiceException, match="entity format is invalid"):
            await spawn(node, "<sdf/>", "third", at())
        text = BOX.replace('<box size="1 1 1"/>', '<mesh filename="package://no_such/a.stl"/>')
        with pytest.raises(ServiceException, match="urdf reference package name does not exist: no_such"):
            await spawn(node, text, "third", at())
        response = await call(node, "spawn_sdf_model", SpawnModel, "third", "<html/>", "", at(), "")
        assert not response.success
        assert response.status_message.startswith(
            "GazeboRosApiPlugin SpawnModel Failure: input model_xml not SDF"
        )

        state = await call(node, "get_model_state", GetModelState, "other", "box")
        assert state.success
        assert state.status_message == "GetModelState: got properties"
        assert (state.pose.position.x, state.pose.position.z) == (1.0, 0.0)
        assert state.header.seq == 1
        assert state.header.frame_id == "box"
        state = await call(node, "get_model_state", GetModelState, "none", "")
        assert (state.success, state.status_message) == (False, "GetModelState: model does not exist")
        state = await call(node, "get_link_state", GetLinkState, "none::link", "")
        assert state.status_message == (
            "GetLinkState: link not found, did you forget to scope the link by model name?"
        )

        wanted = ModelState("box", at(x=3, z=1), Twist(), "other")
        assert (await call(node, "set_model_state", SetModelState, wanted)).success
        state = await call(node, "get_link_state", GetLinkState, "box::base_link", "world")
        position = state.link_state.pose.position
        assert (position.x, position.y, position.z) == (4.0, 0.0, 6.0)
        assert (await call(node, "set_link_state", SetLinkState, state.link_state)).success

        properties = await call(node, "get_model_properties", GetModelProperties, "box")
        assert properties.body_names == ["base_link"]
        assert properties.geom_names == ["base_link_collision"]
        link = await call(node, "get_link_properties", GetLinkProperties, "box::base_link")
        assert (link.mass, link.ixx, link.gravity_mode) == (1.0, 0.1, True)
        inertia = (link.ixx, link.ixy, link.ixz, link.iyy, link.iyz, link.izz)
        arguments = ("box::base_link", Pose(), False, 3.0, *inertia)
        assert (await call(node, "set_link_properties", SetLinkProperties, *arguments)).success
        link = await call(node, "get_link_properties", GetLinkProperties, "box::base_link")
        assert (link.mass, link.gravity_mode) == (3.0, False)
        refused = await call(
            node, "set_link_properties", SetLinkProperties, "box::base_link", Pose(), True, -1.0, *inertia
        )
        assert (refused.success, refused.status_message) == (False, "SetLinkProperties: the mass is -1.0")

        world = await call(node, "get_world_properties", GetWorldProperties)
        assert world.model_names == ["ground_plane", "box", "other"]
        assert (await call(node, "delete_model", DeleteModel, "box")).success
        response = await call(node, "delete_model", DeleteModel, "box")
        assert response.status_message == "DeleteModel: model does not exist"

    run(body)


def test_joints_and_forces_of_models(master: str, start: Start) -> None:
    start_world(start, "-u")

    async def body(node: Node) -> None:
        assert (await spawn(node, ARM, "arm", at(z=1)))[0]
        assert (await spawn(node, BOX, "box", at(y=5, z=0.5)))[0]
        await call(node, "set_model_configuration", SetModelConfiguration, "arm", "", ["hinge"], [0.5])
        hinge = await call(node, "get_joint_properties", GetJointProperties, "hinge")
        assert list(hinge.position) == [0.5]
        response = await call(
            node, "set_model_configuration", SetModelConfiguration, "arm", "", ["hinge"], []
        )
        assert response.status_message.endswith("joint name and position list have different lengths")

        config = ODEJointProperties(damping=[0.5], hiStop=[0.2], loStop=[-0.2])
        arguments = ("hinge", config)
        assert (await call(node, "set_joint_properties", SetJointProperties, *arguments)).success
        config = ODEJointProperties(damping=[0.0], hiStop=[1e16], loStop=[-1e16])
        assert (await call(node, "set_joint_properties", SetJointProperties, "hinge", config)).success

        effort = await call(node, "apply_joint_effort", ApplyJointEffort, "hinge", 0.1, Time(), Duration(-1))
        assert effort.status_message == "ApplyJointEffort: effort set"
        wrench = Wrench(Vector3(0, 0, 30), Vector3())
        arguments = ("box::base_link", "", Point(), wrench, Time(), Duration(-1))
        assert (await call(node, "apply_body_wrench", ApplyBodyWrench, *arguments)).success
        await call(node, "unpause_physics", Empty)

        def flies(states: LinkStates) -> bool:
            return states.pose[states.name.index("box::base_link")].position.z > 3

        await until(node, "/gazebo/link_states", LinkStates, flies)
        assert (await call(node, "get_joint_properties", GetJointProperties, "hinge")).rate[0] > 0.1
        await call(node, "clear_body_wrenches", BodyRequest, "box::base_link")

        def has_landed(states: LinkStates) -> bool:
            return states.pose[states.name.index("box::base_link")].position.z < 0.6

        await until(node, "/gazebo/link_states", LinkStates, has_landed)

    run(body)


def test_no_clock_while_paused_and_resets(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await until(node, "/clock", Clock, lambda clock: clock.clock.to_sec() > 0.5)
        assert (await spawn(node, BOX, "box", at(z=5)))[0]
        await call(node, "pause_physics", Empty)
        physics = await call(node, "get_physics_properties", GetPhysicsProperties)
        assert (physics.pause, physics.time_step, physics.max_update_rate) == (True, 0.001, 1000.0)
        assert physics.gravity.z == -9.8
        before = (await call(node, "get_world_properties", GetWorldProperties)).sim_time
        gravity = Vector3(0, 0, 1)
        arguments = (0.002, 0.0, gravity, physics.ode_config)
        assert (await call(node, "set_physics_properties", SetPhysicsProperties, *arguments)).success
        assert (await call(node, "get_world_properties", GetWorldProperties)).sim_time == before
        await call(node, "step_physics", Empty)
        after = await call(node, "get_world_properties", GetWorldProperties)
        assert math.isclose(after.sim_time, before + 0.002)
        before = after.sim_time
        await call(node, "reset_world", Empty)
        after = await call(node, "get_world_properties", GetWorldProperties)
        assert after.sim_time == before
        await call(node, "reset_simulation", Empty)
        assert (await call(node, "get_world_properties", GetWorldProperties)).sim_time == 0
        state = await call(node, "get_model_state", GetModelState, "box", "")
        assert state.pose.position.z == 5

        # The box rises, because gravity points up. The subscription is new: the time of the step may be above 1 s.
        await call(node, "unpause_physics", Empty)
        await until(node, "/clock", Clock, lambda clock: clock.clock.to_sec() > 1)
        state = await call(node, "get_model_state", GetModelState, "box", "")
        assert state.pose.position.z > 5.4

    run(body)


def test_markers_show_the_world(master: str, start: Start) -> None:
    start_world(start, "-u")

    async def body(node: Node) -> None:
        await spawn(node, BOX, "box", at(z=5))
        message = await until(node, "/gazebo/world_markers", MarkerArray, lambda each: len(each.markers) == 3)
        names = [(marker.ns, marker.action, marker.header.frame_id) for marker in message.markers]
        assert names == [("", 3, "world"), ("ground_plane::link", 0, "world"), ("box::base_link", 0, "world")]
        box = message.markers[2]
        assert (box.type, box.scale.x, box.pose.position.z) == (box.CUBE, 1.0, 5.0)

        # A third model: the box has moved meanwhile, the plane has not.
        await call(node, "set_model_state", SetModelState, ModelState("box", at(z=7), Twist(), ""))
        await spawn(node, BOX, "other", at(x=3, z=5))
        message = await until(node, "/gazebo/world_markers", MarkerArray, lambda each: len(each.markers) == 4)
        heights = [marker.pose.position.z for marker in message.markers[1:]]
        assert heights == [0.0, 7.0, 5.0]

    run(body)


def test_without_ros_network_only_the_clock_is_published(master: str, start: Start) -> None:
    async def body(node: Node) -> None:
        await node.set_param("/gazebo/enable_ros_network", False)
        start_world(start)
        await until(node, "/clock", Clock, lambda clock: clock.clock.to_sec() > 0.1)
        code, _, services = await node.call_master("getSystemState"), None, None
        assert "/gazebo/pause_physics" not in str(code) + str(services)

    run(body)


@pytest.mark.parametrize(
    ("words", "status", "line"),
    [
        (
            ["-urdf", "-model", "a", "-file", "no_such.urdf"],
            1,
            "Error: specified file no_such.urdf does not exist",
        ),
        (["-urdf", "-model", "a", "-param", "none"], 1, "Error: param does not exist or is empty"),
        (["-urdf", "-model", "a", "-stdin"], 1, "Error: stdin buffer was empty"),
        (["-urdf", "-stdin"], 2, "the following arguments are required: -model"),
        (["-model", "a", "-stdin"], 2, "one of the arguments -urdf -sdf is required"),
    ],
)
def test_spawn_model_without_a_model(master: str, words: list[str], status: int, line: str) -> None:
    command = [*Packages().find_executable("gazebo_ros", "spawn_model"), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=SECONDS, input="")
    assert done.returncode == status
    assert line in done.stderr


def test_spawn_model_sets_joints_and_deletes_at_its_end(master: str, tmp_path: Path, start: Start) -> None:
    start_world(start, "-u")
    file = written(tmp_path, "arm.urdf", ARM)
    words = ("-urdf", "-file", file, "-model", "arm", "-z", "1", "-J", "hinge", "0.25", "-b")
    process = start("gazebo_ros", "spawn_model", *words)

    async def body(node: Node) -> None:
        while (await call(node, "get_joint_properties", GetJointProperties, "hinge")).position != (0.25,):
            await asyncio.sleep(0.05)
        assert process.stdout is not None
        while "Waiting for shutdown to delete model arm" not in await asyncio.to_thread(
            process.stdout.readline
        ):
            pass
        await asyncio.to_thread(end, process)
        world = await call(node, "get_world_properties", GetWorldProperties)
        assert world.model_names == ["ground_plane"]

    run(body)


def test_a_world_that_does_not_exist(master: str, start: Start) -> None:
    process = start_world(start, "no_such.world")
    assert process.wait(SECONDS) == 1
    _, errors = end(process)
    assert (
        errors == "gzserver: no_such.world: there is no such world file, here or below GAZEBO_RESOURCE_PATH\n"
    )


def test_parts_that_a_world_lacks_are_named_once(master: str, tmp_path: Path, start: Start) -> None:
    uri = "model://no_such/wall.dae"
    link = (
        f'<link name="l"><visual name="v"><geometry><mesh><uri>{uri}</uri></mesh></geometry></visual></link>'
    )
    models = "\n".join(f'<model name="m{index}">{link}</model>' for index in range(3))
    world = written(tmp_path, "my.world", f'<sdf version="1.6"><world name="w">{models}</world></sdf>')
    output, errors = start_world(start, world, "--iters", "5").communicate(timeout=SECONDS)
    assert (output + errors).count(uri) == 1
    assert f"my.world:1: visual [v] is left out: the mesh {uri} does not exist" in output + errors
    assert "(add its folder to GAZEBO_MODEL_PATH) (and 2 more)" in output + errors


def test_values_that_are_not_finite_are_refused(master: str, start: Start) -> None:
    process = start_world(start, "-u")

    async def body(node: Node) -> None:
        assert (await spawn(node, BOX, "box", at(z=5)))[0]
        refused = (False, "box: a force, position or velocity is not finite")
        state = ModelState(model_name="box", pose=at(x=math.nan))
        response = await call(node, "set_model_state", SetModelState, state)
        assert (response.success, response.status_message) == refused
        state.pose.position.x = 1.0
        assert (await call(node, "set_model_state", SetModelState, state)).success

    run(body)
    end(process)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for a single process")
def test_gzserver_ends_with_0_after_ctrl_c(master: str, start: Start) -> None:
    process = start_world(start)

    async def body(node: Node) -> None:
        assert (await call(node, "get_world_properties", GetWorldProperties)).success
        process.send_signal(signal.SIGINT)
        assert await asyncio.to_thread(process.wait, SECONDS) == 0

    run(body)


def test_gzserver_ends_after_a_number_of_steps(master: str, start: Start) -> None:
    assert start_world(start, "--iters", "300").wait(SECONDS) == 0


def test_gzserver_names_itself(start: Start) -> None:
    process = start("gazebo_ros", "gzserver", "--version")
    assert process.communicate(timeout=SECONDS)[0] == "minirospy's simulation (MuJoCo) under Gazebo's names\n"


def test_gzclient_prints_the_address_of_the_world(master: str, start: Start) -> None:
    pytest.importorskip("websockets")
    process = start("gazebo_ros", "gzclient", "--no-browser")
    assert process.stdout is not None
    line = process.stdout.readline()
    assert line.startswith("Open in a browser: http://127.0.0.1:")
    assert "/#/simulation?token=" in line


@pytest.mark.skipif(sys.platform == "win32", reason="BROWSER names a program of POSIX")
def test_the_window_ends_if_gazebo_is_killed(
    master: str, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("websockets")
    monkeypatch.setenv("BROWSER", "true")
    process = start("gazebo_ros", "gazebo", "-u")
    assert process.stdout is not None
    while not (line := process.stdout.readline()).startswith("The browser opens http://127.0.0.1:"):
        assert process.poll() is None
    port = int(line.partition("127.0.0.1:")[2].partition("/")[0])
    socket.create_connection(("127.0.0.1", port)).close()
    process.kill()

    async def until_refused() -> None:
        while True:
            try:
                _, writer = await asyncio.open_connection("127.0.0.1", port)
            except ConnectionRefusedError:
                return
            writer.close()
            await asyncio.sleep(0.05)

    asyncio.run(asyncio.wait_for(until_refused(), SECONDS))


@pytest.mark.skipif(sys.platform == "win32", reason="BROWSER names a program of POSIX")
def test_gazebo_opens_the_window_too(master: str, start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("websockets")
    monkeypatch.setenv("BROWSER", "true")
    process = start("gazebo_ros", "gazebo", "-u")
    assert process.stdout is not None
    while not process.stdout.readline().startswith("The browser opens http://127.0.0.1:"):
        assert process.poll() is None

    async def body(node: Node) -> None:
        assert (await call(node, "get_world_properties", GetWorldProperties)).success

    run(body)
