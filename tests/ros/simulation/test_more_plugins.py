"""planar_move, skid_steer_drive, the mimic joint and ft_sensor, with real processes."""

from __future__ import annotations

import math

from gazebo_msgs.srv import GetJointProperties, SetModelConfiguration, SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3, WrenchStamped
from nav_msgs.msg import Odometry

from minirospy import Node
from tests.ros.simulation.processes import BOX, Start, call, run, start_world, until

INERTIAL = """<inertial><mass value="{}"/>
  <inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial>"""
WHEEL = """<joint name="{name}_joint" type="continuous"><axis xyz="0 1 0"/><origin xyz="{x} {y} 0"/>
  <parent link="base"/><child link="{name}"/></joint>
<link name="{name}">{inertial}<collision><geometry><sphere radius="0.1"/></geometry></collision></link>"""
SIDES = {
    "left_front": (0.15, 0.2),
    "right_front": (0.15, -0.2),
    "left_rear": (-0.15, 0.2),
    "right_rear": (-0.15, -0.2),
}
SKID = (
    f'<robot name="skid"><link name="base">{INERTIAL.format(4)}</link>'
    + "".join(
        WHEEL.format(name=name, x=x, y=y, inertial=INERTIAL.format(0.5)) for name, (x, y) in SIDES.items()
    )
    + '<gazebo><plugin name="skid" filename="libgazebo_ros_skid_steer_drive.so">'
    "<wheelDiameter>0.2</wheelDiameter></plugin></gazebo></robot>"
)
ARM = f"""<robot name="arm"><link name="world"/>
  <joint name="leader" type="revolute"><axis xyz="0 0 1"/><origin xyz="0 0 1"/><parent link="world"/><child link="a"/>
    <limit lower="-3" upper="3" effort="10" velocity="5"/><dynamics damping="1"/></joint>
  <link name="a">{INERTIAL.format(2)}</link>
  <joint name="follower" type="revolute"><axis xyz="0 0 1"/><origin xyz="1 0 1"/><parent link="world"/><child link="b"/>
    <limit lower="-3" upper="3" effort="10" velocity="5"/></joint>
  <link name="b">{INERTIAL.format(2)}</link>
  <gazebo>
    <plugin name="mimic" filename="libroboticsgroup_upatras_gazebo_mimic_joint_plugin.so">
      <joint>leader</joint><mimicJoint>follower</mimicJoint><multiplier>-2</multiplier><offset>0.1</offset></plugin>
    <plugin name="force" filename="libgazebo_ros_ft_sensor.so">
      <jointName>leader</jointName><topicName>wrench</topicName><updateRate>50</updateRate></plugin>
  </gazebo></robot>"""


async def spawn(node: Node, name: str, text: str, z: float) -> None:
    pose = Pose(Point(0.0, 0.0, z), Quaternion(0.0, 0.0, 0.0, 1.0))
    response = await call(node, "spawn_urdf_model", SpawnModel, name, text, f"/{name}", pose, "")
    assert response.success, response.status_message


def test_a_skid_steer_robot_drives_straight(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await spawn(node, "skid", SKID, 0.1)
        commands = await node.advertise("/skid/cmd_vel", Twist, latch=True)
        await commands.publish(Twist(Vector3(0.3, 0.0, 0.0), Vector3()))
        odometry = await until(node, "/skid/odom", Odometry, lambda each: each.pose.pose.position.x > 0.3)
        assert abs(odometry.pose.pose.position.y) < 0.02
        assert math.isclose(odometry.twist.twist.linear.x, 0.3, abs_tol=0.02)
        assert odometry.pose.covariance[0] == 1e-4

    run(body)


def test_planar_move_moves_a_model_sideways(master: str, start: Start) -> None:
    start_world(start)
    plugin = '<gazebo><plugin name="move" filename="libgazebo_ros_planar_move.so"/></gazebo></robot>'

    async def body(node: Node) -> None:
        await spawn(node, "box", BOX.replace("</robot>", plugin), 0.5)
        commands = await node.advertise("/box/cmd_vel", Twist, latch=True)
        await commands.publish(Twist(Vector3(0.0, 0.5, 0.0), Vector3()))
        odometry = await until(node, "/box/odom", Odometry, lambda each: each.pose.pose.position.y > 0.3)
        assert abs(odometry.pose.pose.position.x) < 0.01
        assert math.isclose(odometry.twist.twist.linear.y, 0.5, abs_tol=0.02)

    run(body)


def test_a_joint_mimics_another_one_and_its_force_is_measured(master: str, start: Start) -> None:
    start_world(start)

    async def body(node: Node) -> None:
        await spawn(node, "arm", ARM, 0.0)
        await call(node, "set_model_configuration", SetModelConfiguration, "arm", "", ["leader"], [0.5])

        async def position(joint: str) -> float:
            return float((await call(node, "get_joint_properties", GetJointProperties, joint)).position[0])

        # The follower's motor reaches the target: -2 * 0.5 + 0.1.
        while not math.isclose(await position("follower"), -0.9, abs_tol=0.01):
            pass
        assert math.isclose(await position("leader"), 0.5, abs_tol=0.01)

        def carries_weight(message: WrenchStamped) -> bool:
            return math.isclose(abs(message.wrench.force.z), 2 * 9.8, abs_tol=0.1)

        message = await until(node, "/arm/wrench", WrenchStamped, carries_weight)
        assert message.header.frame_id == "a"
        assert message.wrench.force.z < 0

    run(body)
