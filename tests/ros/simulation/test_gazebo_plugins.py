"""Plugins of gazebo_plugins on a robot with two wheels, with real processes."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path

import pytest
from gazebo_msgs.msg import ContactsState
from gazebo_msgs.srv import DeleteModel, SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu, JointState, LaserScan, Range
from std_msgs.msg import Float64
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from minirospy import Node
from tests.conftest import write_files
from tests.ros.simulation.processes import Start, call, end, run, start_world, until

ROVER = (Path(__file__).parent / "rover.urdf").read_text()
UP = Quaternion(0.0, 0.0, 0.0, 1.0)
WALL = """<sdf version="1.6"><model name="wall"><static>true</static><link name="link">
  <collision name="wall"><geometry><box><size>0.2 20 2</size></box></geometry></collision></link></model></sdf>"""


async def spawn_rover(node: Node) -> None:
    arguments = ("rover", ROVER, "/", Pose(Point(0.0, 0.0, 0.01), UP), "")
    response = await call(node, "spawn_urdf_model", SpawnModel, *arguments)
    assert response.success, response.status_message


async def spawn_wall(node: Node, x: float) -> None:
    arguments = ("wall", WALL, "", Pose(Point(x, 0.0, 1.0), UP), "")
    assert (await call(node, "spawn_sdf_model", SpawnModel, *arguments)).success


def yaw(rotation: Quaternion) -> float:
    return 2 * math.atan2(rotation.z, rotation.w)


def test_the_robot_drives_a_circle(master: str, start: Start) -> None:
    process = start_world(start)

    async def body(node: Node) -> None:
        await spawn_rover(node)
        commands = await node.advertise("/cmd_vel", Twist, latch=True)
        await commands.publish(Twist(Vector3(0.2, 0.0, 0.0), Vector3(0.0, 0.0, 0.5)))

        def is_fast(odometry: Odometry) -> bool:
            twist = odometry.twist.twist
            return abs(twist.linear.x - 0.2) < 0.004 and abs(twist.angular.z - 0.5) < 0.01

        await until(node, "/odom", Odometry, is_fast)
        await until(node, "/odom", Odometry, lambda each: abs(yaw(each.pose.pose.orientation)) > 3)
        odometry = await until(node, "/odom", Odometry, lambda _: True)
        assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_footprint")
        # The circle's radius is v / w = 0.4 m; its centre is to the left of the start.
        position = odometry.pose.pose.position
        assert math.isclose(math.hypot(position.x, position.y - 0.4), 0.4, rel_tol=0.05)

        transforms = await until(node, "/tf", TFMessage, lambda _: True)
        transform = transforms.transforms[0]
        assert (transform.header.frame_id, transform.child_frame_id) == ("odom", "base_footprint")
        states = await until(node, "/joint_states", JointState, lambda _: True)
        assert states.name == ["left_joint", "right_joint"]
        truth = await until(node, "/truth", Odometry, lambda _: True)
        assert truth.child_frame_id == "scanner"
        assert math.isclose(truth.pose.pose.position.z, 0.3, abs_tol=0.01)
        assert (await call(node, "delete_model", DeleteModel, "rover")).success
        await spawn_rover(node)
        await until(node, "/odom", Odometry, lambda each: each.pose.pose.position.x < 0.05)

    run(body)
    output, errors = end(process)
    text = output + errors
    assert (
        text.count("libgazebo_ros_hand_of_god.so of model 'rover' is not part of minirospy's simulation") == 1
    )


def test_a_command_that_is_not_finite_does_not_end_the_drive(master: str, start: Start) -> None:
    process = start_world(start)

    async def body(node: Node) -> None:
        await spawn_rover(node)
        commands = await node.advertise("/cmd_vel", Twist, latch=True)
        await commands.wait_for_subscribers(1, 30)
        is_told = asyncio.create_task(until(node, "/rosout", Log, lambda each: "not finite" in each.msg))
        while not is_told.done():
            await commands.publish(Twist(Vector3(math.nan, 0.0, 0.0), Vector3()))
            await asyncio.wait([is_told], timeout=0.1)
        await commands.publish(Twist(Vector3(0.2, 0.0, 0.0), Vector3()))
        await until(node, "/odom", Odometry, lambda each: each.twist.twist.linear.x > 0.15)

    run(body)
    output, errors = end(process)
    assert "a velocity command that is not finite is ignored: x nan" in output + errors


def test_sensors_measure_the_geometry(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await spawn_rover(node)
        await spawn_wall(node, 2.1)
        scan = await until(node, "/scan", LaserScan, lambda each: math.isfinite(each.ranges[90]))
        assert (len(scan.ranges), scan.header.frame_id) == (181, "scanner")
        assert math.isclose(scan.ranges[90], 2.0, abs_tol=2e-3)
        # 45 degrees: the wall is sqrt(2) times as far.
        assert math.isclose(scan.ranges[135], 2 * math.sqrt(2), abs_tol=5e-3)
        assert scan.ranges[0] == math.inf
        assert math.isclose(scan.angle_increment, math.pi / 180, rel_tol=1e-6)
        sonar = await until(node, "/sonar", Range, lambda _: True)
        assert math.isclose(sonar.range, 2.0, abs_tol=5e-3)

        def is_at_rest(imu: Imu) -> bool:
            return math.isclose(imu.linear_acceleration.z, 9.8, abs_tol=0.01)

        imu = await until(node, "/imu", Imu, is_at_rest)
        assert imu.header.frame_id == "scanner"
        await until(node, "/free_imu", Imu, lambda each: abs(each.linear_acceleration.z) < 0.01)

        # The robot drives against the wall.
        commands = await node.advertise("/cmd_vel", Twist, latch=True)
        await commands.publish(Twist(Vector3(0.5, 0.0, 0.0), Vector3()))
        message = await until(node, "/bumper_states", ContactsState, lambda each: bool(each.states))
        contact = message.states[0]
        assert {contact.collision1_name, contact.collision2_name} >= {"wall::link::wall"}
        assert contact.depths

    run(body)


def test_a_plugin_of_the_users_own(
    master: str, tmp_path: Path, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_files(
        tmp_path,
        {
            "my_robot/package.xml": (
                '<package format="2"><name>my_robot</name><version>1.0.0</version><description>d</description>'
                '<maintainer email="a@b.c">a</maintainer><license>BSD</license>'
                '<export><gazebo_ros library="libheight.so" python="height.Height"/></export></package>'
            ),
            "my_robot/src/height.py": (
                "from std_msgs.msg import Float64\n"
                "from gazebo_ros.plugins import ModelPlugin\n\n\n"
                "class Height(ModelPlugin):\n"
                "    def load(self):\n"
                "        self.factor = self.number('factor', 1.0)\n"
                "        self.publisher = self.publish_to('height', Float64)\n\n"
                "    def update(self):\n"
                "        self.publisher.publish(self.factor * self.model.pose.position[2])\n"
            ),
        },
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    start_world(start, "-u")
    plugin = '<plugin name="height" filename="libheight.so"><factor>2</factor></plugin>'

    async def body(node: Node) -> None:
        text = WALL.replace("</link>", f"</link>{plugin}")
        pose = Pose(Point(0.0, 0.0, 3.0), UP)
        assert (await call(node, "spawn_sdf_model", SpawnModel, "wall", text, "/robot", pose, "")).success
        await call(node, "unpause_physics", Empty)
        await until(node, "/robot/height", Float64, lambda each: each.data == 6.0)

    run(body)
