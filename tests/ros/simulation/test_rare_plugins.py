"""block_laser, joint_pose_trajectory, f3d and vacuum_gripper, with real processes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gazebo_msgs.srv import ApplyBodyWrench, GetLinkState, SetJointTrajectory, SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3, Wrench, WrenchStamped
from sensor_msgs.msg import JointState, PointCloud
from std_msgs.msg import Bool, Header
from std_srvs.srv import Empty
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from minirospy import Node
from minirospy.base.times import Duration, Time
from tests.ros.simulation.processes import Start, call, connected, first_of, run, start_world, until

UP = Quaternion(0.0, 0.0, 0.0, 1.0)
INERTIAL = "<inertial><mass>0.2</mass></inertial>"
WALL = """<sdf version="1.6"><model name="wall"><static>true</static><link name="link">
  <collision name="wall"><geometry><box><size>0.2 20 20</size></box></geometry></collision></link></model></sdf>"""
SCANNER = """<sdf version="1.6"><model name="scanner"><static>true</static><link name="link">
  <sensor type="ray" name="rays"><update_rate>20</update_rate><ray>
    <scan><horizontal><samples>5</samples><min_angle>-0.5</min_angle><max_angle>0.5</max_angle></horizontal>
      <vertical><samples>3</samples><min_angle>0</min_angle><max_angle>0.4</max_angle></vertical></scan>
    <range><min>0.1</min><max>2.3</max></range></ray>
    <plugin name="block" filename="libgazebo_ros_block_laser.so">
      <topicName>cloud</topicName><frameName>/scanner</frameName></plugin></sensor></link></model></sdf>"""
ARM = f"""<sdf version="1.6"><model name="arm"><link name="base">{INERTIAL}</link>
  <joint name="fixed" type="fixed"><parent>world</parent><child>base</child></joint>
  <link name="upper">{INERTIAL}</link>
  <joint name="lift" type="prismatic"><parent>base</parent><child>upper</child><axis><xyz>0 0 1</xyz></axis></joint>
  <plugin name="trajectory" filename="libgazebo_ros_joint_pose_trajectory.so"/>
  <plugin name="states" filename="libgazebo_ros_joint_state_publisher.so"/>
  <plugin name="force" filename="libgazebo_ros_f3d.so">
    <bodyName>upper</bodyName><topicName>force</topicName></plugin></model></sdf>"""
GRIPPER = f"""<sdf version="1.6"><model name="gripper"><static>true</static><link name="cup">{INERTIAL}</link>
  <plugin name="vacuum" filename="libgazebo_ros_vacuum_gripper.so"><robotNamespace>cup</robotNamespace>
    <bodyName>cup</bodyName><topicName>grasping</topicName></plugin></model></sdf>"""
CUBE = f"""<sdf version="1.6"><model name="cube"><link name="link">{INERTIAL}
  <collision name="c"><geometry><box><size>0.02 0.02 0.02</size></box></geometry></collision></link></model></sdf>"""


async def spawn(node: Node, name: str, xml: str, x: float = 0.0, z: float = 1.0) -> None:
    arguments = (name, xml, "", Pose(Point(x, 0.0, z), UP), "")
    response = await call(node, "spawn_sdf_model", SpawnModel, *arguments)
    assert response.success, response.status_message


def test_a_block_laser_sees_a_wall(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await spawn(node, "wall", WALL, 2.1)
        await spawn(node, "scanner", SCANNER)
        cloud = await until(node, "/cloud", PointCloud, lambda _: True)
        assert cloud.header.frame_id == "scanner"
        points = np.array([(each.x, each.y, each.z) for each in cloud.points])
        assert len(points) == len(cloud.channels[0].values) == 15
        assert points[2] == pytest.approx((2.0, 0.0, 0.0), abs=1e-3)  # the middle of the lowest row
        assert points[7] == pytest.approx((2.0, 0.0, 2.0 * math.tan(0.2)), abs=1e-3)
        assert np.linalg.norm(points[14]) == pytest.approx(2.3, abs=1e-3)  # the wall is out of range

    run(body)


def test_a_trajectory_sets_the_joints(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await spawn(node, "arm", ARM, z=3.0)
        trajectory = JointTrajectory(header=Header(frame_id="world"), joint_names=["lift"])
        trajectory.points = [
            JointTrajectoryPoint(positions=[0.25], time_from_start=Duration(3)),
            JointTrajectoryPoint(positions=[0.75], time_from_start=Duration(1000)),
        ]
        # Subscribe before: on a busy machine, the first point may have passed until a subscription is connected.
        states = await connected(node, "/arm/joint_states", JointState)
        publisher = await node.advertise("/set_joint_trajectory", JointTrajectory, latch=True)
        await publisher.publish(trajectory)
        # Gravity does not move a held joint.
        await first_of(states, lambda each: abs(each.position[0] - 0.25) < 1e-3)
        await first_of(states, lambda each: abs(each.position[0] - 0.75) < 1e-3)
        trajectory.points = [JointTrajectoryPoint(positions=[0.5], time_from_start=Duration(1000))]
        arguments = ["arm", trajectory, Pose(orientation=UP), False, True]
        response = await node.call("/set_joint_trajectory", SetJointTrajectory, *arguments)
        assert response.success
        await first_of(states, lambda each: abs(each.position[0] - 0.5) < 1e-3)
        trajectory.header.frame_id = "nowhere"
        response = await node.call("/set_joint_trajectory", SetJointTrajectory, *arguments)
        assert (response.success, response.status_message) == (
            False,
            "SetJointTrajectory: the reference link does not exist",
        )

    run(body)


def test_f3d_shows_the_forces_of_services(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await spawn(node, "arm", ARM, z=3.0)
        await until(node, "/force", WrenchStamped, lambda each: each.wrench.force.z == 0)
        wrench = Wrench(Vector3(0.0, 0.0, 2.5), Vector3())
        arguments = ("arm::upper", "world", Point(), wrench, Time(), Duration(-1))
        assert (await call(node, "apply_body_wrench", ApplyBodyWrench, *arguments)).success
        message = await until(node, "/force", WrenchStamped, lambda each: each.wrench.force.z > 0)
        assert (message.wrench.force.z, message.header.frame_id) == (2.5, "world")

    run(body)


def test_a_vacuum_gripper_holds_a_cube(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await spawn(node, "gripper", GRIPPER)
        await until(node, "/cup/grasping", Bool, lambda each: not each.data)
        await node.wait_for_service("/cup/on")
        await node.call("/cup/on", Empty)
        await spawn(node, "cube", CUBE, z=0.97)
        await until(node, "/cup/grasping", Bool, lambda each: each.data)

        async def height() -> float:
            response = await call(node, "get_link_state", GetLinkState, "cube::link", "world")
            return float(response.link_state.pose.position.z)

        while await height() < 0.985:
            pass
        assert await height() == pytest.approx(1.0, abs=0.05)
        await node.call("/cup/off", Empty)
        while await height() > 0.1:
            pass
        await until(node, "/cup/grasping", Bool, lambda each: not each.data)

    run(body)
