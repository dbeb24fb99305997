"""gazebo_ros_control: controllers of a simulated arm, with real processes."""

from __future__ import annotations

import asyncio
import math
import subprocess
from pathlib import Path

import pytest
from controller_manager_msgs.srv import (
    ListControllers,
    LoadController,
    SwitchController,
    SwitchControllerRequest,
)
from gazebo_msgs.srv import DeleteModel, GetWorldProperties
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

from minirospy import Node
from tests.conftest import write_files
from tests.ros.robot_state_publisher.conftest import SECONDS
from tests.ros.simulation.processes import Start, call, connected, end, first_of, run, until, written

LINK = """<link name="{}"><inertial><origin xyz="0 0 0.2"/><mass value="1"/>
  <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>"""
JOINT = """<joint name="{name}" type="revolute"><axis xyz="0 1 0"/><origin xyz="0 {y} 1"/>
  <parent link="world"/><child link="{name}_link"/><limit lower="-300" upper="300" effort="50" velocity="4"/></joint>
<transmission name="{name}_drive"><type>transmission_interface/SimpleTransmission</type>
  <joint name="{name}"><hardwareInterface>hardware_interface/{interface}</hardwareInterface></joint>
  <actuator name="{name}_motor"/></transmission>"""


def robot(**interfaces: str) -> str:
    """Return a robot of joints side by side, each with its own interface."""
    parts = [
        LINK.format(f"{name}_link") + JOINT.format(name=name, y=index, interface=interface)
        for index, (name, interface) in enumerate(interfaces.items())
    ]
    plugin = '<gazebo><plugin name="control" filename="libgazebo_ros_control.so"/></gazebo>'
    return f'<robot name="rig"><link name="world"/>{"".join(parts)}{plugin}</robot>'


ROBOT = robot(
    direct="PositionJointInterface",
    tuned="PositionJointInterface",
    wheel="VelocityJointInterface",
    pushed="EffortJointInterface",
)
CONTROLLERS = """
states: {type: joint_state_controller/JointStateController, publish_rate: 50}
direct_controller: {type: position_controllers/JointPositionController, joint: direct}
tuned_controller: {type: position_controllers/JointPositionController, joint: tuned}
wheel_controller: {type: velocity_controllers/JointVelocityController, joint: wheel}
pushed_controller: {type: effort_controllers/JointEffortController, joint: pushed}
gazebo_ros_control: {pid_gains: {tuned: {p: 100.0, i: 10.0, d: 5.0}}}
"""
NAMES = "states direct_controller tuned_controller wheel_controller pushed_controller"


FREE = (
    robot(direct="PositionJointInterface", wheel="VelocityJointInterface", pushed="EffortJointInterface")
    .replace('<limit lower="-300" upper="300" effort="50" velocity="4"/>', "")
    .replace('"revolute"', '"continuous"')
)


def start_robot(launch: Start, folder: Path, robot: str = ROBOT, names: str = NAMES) -> subprocess.Popen[str]:
    urdf = written(folder, "rig.urdf", robot)
    gains = written(folder, "controllers.yaml", CONTROLLERS)
    file = written(
        folder,
        "rig.launch",
        f"""<launch>
          <include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="gui" value="false"/></include>
          <param name="robot_description" textfile="{urdf}"/>
          <rosparam file="{gains}"/>
          <node name="spawn" pkg="gazebo_ros" type="spawn_model" args="-urdf -param robot_description -model rig"/>
          <node name="spawner" pkg="controller_manager" type="spawner" args="{names}" output="screen"/>
        </launch>""",
    )
    return launch(file)


async def running(node: Node) -> list[str]:
    """Return the names of the running controllers."""
    listed = await node.call("/controller_manager/list_controllers", ListControllers)
    return [each.name for each in listed.controller if each.state == "running"]


def test_each_interface_moves_its_joint(master: str, tmp_path: Path, launch: Start) -> None:
    process = start_robot(launch, tmp_path)

    async def body(node: Node) -> None:
        await node.wait_for_service("/controller_manager/list_controllers", SECONDS)
        while await running(node) != NAMES.split():
            await asyncio.sleep(0.05)
        targets = {"direct": 0.5, "tuned": -0.4, "wheel": 1.0, "pushed": 1.0}
        publishers = {
            name: await node.advertise(f"/{name}_controller/command", Float64, latch=True) for name in targets
        }
        for name, publisher in publishers.items():
            await publisher.publish(Float64(targets[name]))

        def has_arrived(state: JointState) -> bool:
            positions = dict(zip(state.name, state.position, strict=True))
            velocities = dict(zip(state.name, state.velocity, strict=True))
            return (
                math.isclose(positions["direct"], 0.5, abs_tol=1e-3)
                and math.isclose(positions["tuned"], -0.4, abs_tol=0.05)
                and math.isclose(velocities["wheel"], 1.0, abs_tol=1e-2)
            )

        await until(node, "/joint_states", JointState, has_arrived)

        # After a reset of the time, the controllers are restarted: the joints are held where they started.
        # Subscribe before: on a busy machine, as much time may pass again until a subscription is connected.
        states = await connected(node, "/joint_states", JointState)
        before = (await call(node, "get_world_properties", GetWorldProperties)).sim_time
        await call(node, "reset_simulation", Empty)

        def is_at_start(state: JointState) -> bool:
            return state.header.stamp.to_sec() < before and abs(state.position[0]) < 1e-3

        await first_of(states, is_at_start)
        assert (await call(node, "delete_model", DeleteModel, "rig")).success

    run(body)
    output, _ = end(process)
    assert "Loaded gazebo_ros_control." in output


CONTROLLER = """from controller_interface import Controller
from hardware_interface import Interface

class Raw(Controller):
    interfaces = (Interface.POSITION, Interface.VELOCITY, Interface.EFFORT)

    def init(self, hardware, context):
        self.value = context.parameters.number("value", 0.0)
        self.joints = [
            hardware.joint(name, kind) for name, kind in zip(("direct", "wheel", "pushed"), self.interfaces)
        ]

    def update(self, time, period):
        direct, wheel, pushed = self.joints
        direct.position_command = wheel.velocity_command = self.value
        pushed.effort_command = 0.0 if self.value == 1e300 else self.value
"""
PACKAGE = {
    "package.xml": """<package format="2"><name>raw_control</name><version>0.1.0</version><description>d</description>
      <maintainer email="a@b.c">me</maintainer><license>BSD</license>
      <export><controller_interface plugin="${prefix}/plugins.xml"/></export></package>""",
    "plugins.xml": """<library path="raw_control"><class name="raw_control/Raw" type="raw_control.raw.Raw"
      base_class_type="controller_interface::ControllerBase"/></library>""",
    "src/raw_control/__init__.py": "",
    "src/raw_control/raw.py": CONTROLLER,
}


def test_commands_that_are_not_finite_do_not_reach_the_physics(
    master: str, tmp_path: Path, launch: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_files(tmp_path / "raw_control", PACKAGE)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    process = start_robot(launch, tmp_path, FREE, "states")

    async def body(node: Node) -> None:
        await node.wait_for_service("/controller_manager/list_controllers", SECONDS)
        for number, value in enumerate((math.nan, math.inf, 1e300)):
            name = f"raw{number}"
            is_told = asyncio.create_task(until(node, "/rosout", Log, lambda each: "not finite" in each.msg))
            await node.set_param(f"/{name}", {"type": "raw_control/Raw", "value": value})
            assert (await node.call("/controller_manager/load_controller", LoadController, name)).ok
            switch = SwitchControllerRequest(
                start_controllers=[name], strictness=SwitchControllerRequest.STRICT
            )
            assert (await node.call("/controller_manager/switch_controller", SwitchController, switch)).ok
            if number == 0:
                line = (
                    "model 'rig': commands that are not finite were replaced, joints: direct, wheel, pushed"
                )
                assert (await is_told).msg == line
            is_told.cancel()
            await until(
                node, "/joint_states", JointState, lambda each: all(map(math.isfinite, each.position))
            )
            if number < 2:
                await until(node, "/joint_states", JointState, lambda each: abs(each.position[0]) < 1e-3)
            switch = SwitchControllerRequest(
                stop_controllers=[name], strictness=SwitchControllerRequest.STRICT
            )
            assert (await node.call("/controller_manager/switch_controller", SwitchController, switch)).ok
        assert "rig" in (await call(node, "get_world_properties", GetWorldProperties)).model_names

    run(body)
    output, errors = end(process)
    assert "is closed" not in output + errors
