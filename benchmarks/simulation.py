"""`python benchmarks/simulation.py`: speed, CPU time and memory of the simulation, in one run.

Each case is `gzserver` with robots that move; this program sends the commands, and subscribes to the sensors. CPU time and
memory are the process's. The real-time factor is simulated time over wall time; on a busy machine, simulated time over the
process's CPU time tells what an idle core would reach. All traffic is on loopback.
"""

from __future__ import annotations

import cProfile
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from cases import BIN, measure_cases

WARM_UP = 5.0  # seconds of motion before the measurement
COLUMNS = ("CPU, %", "real-time factor", "per CPU second", "PSS, MB", "scans/s", "first scan, s")

ROBOT = """<robot name="robot">
  <link name="base_footprint"/>
  <joint name="base" type="fixed"><parent link="base_footprint"/><child link="base_link"/><origin xyz="0 0 0.01"/></joint>
  <link name="base_link">
    <inertial><origin xyz="0 0 0.05"/><mass value="0.8"/>
      <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.002"/></inertial>
    <visual><origin xyz="-0.03 0 0.07"/><geometry><box size="0.14 0.14 0.143"/></geometry></visual>
    <collision><origin xyz="-0.03 0 0.07"/><geometry><box size="0.14 0.14 0.143"/></geometry></collision>
  </link>
  {wheels}
  <link name="caster"><collision><geometry><sphere radius="0.005"/></geometry></collision></link>
  <joint name="caster_joint" type="fixed"><parent link="base_link"/><child link="caster"/><origin xyz="-0.08 0 -0.004"/></joint>
  <link name="scan"/>
  <joint name="scan_joint" type="fixed"><parent link="base_link"/><child link="scan"/><origin xyz="-0.03 0 0.172"/></joint>
  <gazebo reference="caster"><mu1>0</mu1><mu2>0</mu2></gazebo>
  <gazebo reference="scan">
    <sensor type="ray" name="lidar"><update_rate>5</update_rate><ray>
      <scan><horizontal><samples>360</samples><min_angle>0</min_angle><max_angle>6.28319</max_angle></horizontal></scan>
      <range><min>0.12</min><max>3.5</max></range><noise><type>gaussian</type><mean>0</mean><stddev>0.01</stddev></noise></ray>
      <plugin name="lidar" filename="libgazebo_ros_laser.so"><topicName>scan</topicName><frameName>scan</frameName></plugin>
    </sensor>
    <sensor type="imu" name="imu"><update_rate>200</update_rate>
      <plugin name="imu" filename="libgazebo_ros_imu_sensor.so"><topicName>imu</topicName><frameName>scan</frameName>
        <updateRateHZ>200</updateRateHZ></plugin></sensor>
  </gazebo>
  <gazebo>
    <plugin name="drive" filename="libgazebo_ros_diff_drive.so"><leftJoint>left_joint</leftJoint>
      <rightJoint>right_joint</rightJoint><wheelSeparation>0.16</wheelSeparation><wheelDiameter>0.066</wheelDiameter>
      <wheelTorque>10</wheelTorque><updateRate>30</updateRate></plugin>
    <plugin name="states" filename="libgazebo_ros_joint_state_publisher.so"><jointName>left_joint, right_joint</jointName>
      <updateRate>30</updateRate></plugin>
  </gazebo>
</robot>"""
"""A robot with the sensors and rates of a TurtleBot3 Burger."""

POINTS = """<gazebo reference="scan"><sensor type="ray" name="points"><update_rate>10</update_rate><ray><scan>
    <horizontal><samples>1875</samples><min_angle>-3.14159</min_angle><max_angle>3.14159</max_angle></horizontal>
    <vertical><samples>16</samples><min_angle>-0.2618</min_angle><max_angle>0.2618</max_angle></vertical></scan>
    <range><min>0.3</min><max>131</max></range></ray>
    <plugin name="points" filename="libgazebo_ros_velodyne_laser.so"><topicName>points</topicName></plugin></sensor></gazebo>"""
"""A scanner with the rays and the rate of a VLP-16."""

WHEEL = """<link name="{side}_wheel"><inertial><mass value="0.03"/>
    <inertia ixx="2e-5" ixy="0" ixz="0" iyy="2e-5" iyz="0" izz="2e-5"/></inertial>
    <collision><origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.033" length="0.018"/></geometry></collision></link>
  <joint name="{side}_joint" type="continuous"><parent link="base_link"/><child link="{side}_wheel"/>
    <origin xyz="0 {y} 0.023"/><axis xyz="0 1 0"/></joint>"""


class Case(NamedTuple):
    """``target``: what is aimed at. ``robots``: with wheels; 0: an arm. ``has_points``: whether they have a 3D scanner."""

    name: str
    target: str
    world: str
    robots: int
    is_fast: bool = False
    has_points: bool = False


TURTLEBOT = "worlds/turtlebot3_world.world"
CASES = {
    "turtlebot": Case("turtlebot3 world, real time", "CPU < 50, < 400 MB", TURTLEBOT, 1),
    "fast": Case("turtlebot3 world, as fast as it goes", "factor > 5", TURTLEBOT, 1, is_fast=True),
    "arm": Case("arm of 7 joints, effort control at 1 kHz", "CPU < 100", "worlds/empty.world", 0),
    "robots": Case("20 robots in one world", "factor 1", "worlds/empty.world", 20),
    "points": Case("turtlebot3 world, 16 x 1875 points", "factor 1", TURTLEBOT, 1, has_points=True),
    "start": Case("roslaunch to the first scan", "< 6 s", TURTLEBOT, 1),
}


def robot(*, has_points: bool = False) -> str:
    """Return the URDF of the robot with wheels."""
    wheels = "".join(WHEEL.format(side=s, y=y) for s, y in (("left", 0.08), ("right", -0.08)))
    return ROBOT.format(wheels=wheels).replace("</robot>", f"{POINTS if has_points else ''}</robot>")


def arm() -> str:
    """Return an arm of seven joints, with transmissions and gazebo_ros_control."""
    links = [
        '<link name="world"/><link name="l0"><inertial><mass value="3"/>'
        '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>'
    ]
    links.append('<joint name="fix" type="fixed"><parent link="world"/><child link="l0"/></joint>')
    for number in range(7):
        axis = "0 0 1" if number % 2 == 0 else "0 1 0"
        links.append(
            f'<link name="l{number + 1}"><inertial><origin xyz="0 0 0.08"/><mass value="{3 - 0.35 * number:.2f}"/>'
            '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
            '<collision><origin xyz="0 0 0.08"/><geometry><cylinder radius="0.05" length="0.12"/></geometry></collision></link>'
            f'<joint name="j{number}" type="revolute"><parent link="l{number}"/><child link="l{number + 1}"/>'
            f'<origin xyz="0 0 0.16"/><axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="3" effort="200"/></joint>'
            f'<transmission name="t{number}"><type>transmission_interface/SimpleTransmission</type><joint name="j{number}">'
            "<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>"
            f'<actuator name="m{number}"/></transmission>'
        )
    plugin = '<gazebo><plugin name="control" filename="libgazebo_ros_control.so"/></gazebo>'
    return f'<robot name="arm">{"".join(links)}{plugin}</robot>'


def spawn(name: str, text: str, namespace: str, x: float, y: float) -> None:
    """Add a model."""
    import rospy
    from gazebo_msgs.srv import SpawnModel
    from geometry_msgs.msg import Point, Pose, Quaternion

    service = rospy.ServiceProxy("/gazebo/spawn_urdf_model", SpawnModel)
    service.wait_for_service(60)
    answer = service(name, text, namespace, Pose(Point(x, y, 0.01), Quaternion(0, 0, 0, 1)), "")
    assert answer.success, answer.status_message


def move_robots(case: Case, count: Callable[[object], None]) -> None:
    """Add the robots, drive them in circles, and subscribe to their sensors."""
    import rospy
    from geometry_msgs.msg import Twist, Vector3
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import Imu, LaserScan, PointCloud2

    for number in range(case.robots):
        namespace = f"/r{number}" if case.robots > 1 else ""
        x, y = (1.5 * (number % 5), 1.5 * (number // 5)) if case.robots > 1 else (-2.0, -0.5)
        text = robot(has_points=case.has_points)
        spawn(f"robot{number}", text, namespace or "/", x, y)
        for topic, kind in (("imu", Imu), ("odom", Odometry)):
            rospy.Subscriber(f"{namespace}/{topic}", kind, lambda _: None)
        rospy.Subscriber(f"{namespace}/scan", LaserScan, count)
        if case.has_points:
            rospy.Subscriber(f"{namespace}/points", PointCloud2, lambda _: None)
        commands = rospy.Publisher(f"{namespace}/cmd_vel", Twist, queue_size=1, latch=True)
        commands.publish(Twist(Vector3(0.1, 0, 0), Vector3(0, 0, 0.4)))


def move_arm() -> None:
    """Add the arm, start a trajectory controller, and send a long trajectory."""
    import rospy
    from controller_manager_msgs.srv import LoadController, SwitchController
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    joints = [f"j{number}" for number in range(7)]
    rospy.set_param("/robot_description", arm())
    rospy.set_param("/states", {"type": "joint_state_controller/JointStateController", "publish_rate": 50})
    gains = {joint: {"p": 600, "d": 30, "i": 1, "i_clamp": 1} for joint in joints}
    kind = "effort_controllers/JointTrajectoryController"
    rospy.set_param("/moves", {"type": kind, "joints": joints, "gains": gains})
    spawn("arm", arm(), "/", 0, 0)
    load = rospy.ServiceProxy("/controller_manager/load_controller", LoadController)
    load.wait_for_service(60)
    assert load("states").ok
    assert load("moves").ok
    switch = rospy.ServiceProxy("/controller_manager/switch_controller", SwitchController)
    assert switch(["states", "moves"], [], 2, False, 0.0).ok
    rospy.Subscriber("/joint_states", JointState, lambda _: None)
    points = [
        JointTrajectoryPoint(
            positions=[0.5 * math.sin(0.5 * step)] * 7,
            velocities=[0.25 * math.cos(0.5 * step)] * 7,
            time_from_start=rospy.Duration(0.5 * step),
        )
        for step in range(1, 400)
    ]
    commands = rospy.Publisher("/moves/command", JointTrajectory, queue_size=1, latch=True)
    commands.publish(JointTrajectory(joint_names=joints, points=points))


def measure(case: Case, seconds: float, command: list[str]) -> dict[str, float]:
    """Run a case, in a process with a node and a new master."""
    import psutil
    import rospy
    from gazebo_msgs.srv import GetPhysicsProperties, GetWorldProperties, SetPhysicsProperties

    process = subprocess.Popen([*command, case.world, "__name:=gazebo"])
    try:
        scans = 0

        def count(_: object) -> None:
            nonlocal scans
            scans += 1

        if case.robots:
            move_robots(case, count)
        else:
            move_arm()
        if case.is_fast:
            physics = rospy.ServiceProxy("/gazebo/get_physics_properties", GetPhysicsProperties)()
            change = rospy.ServiceProxy("/gazebo/set_physics_properties", SetPhysicsProperties)
            assert change(physics.time_step, 0.0, physics.gravity, physics.ode_config).success
        time.sleep(WARM_UP)

        watched = psutil.Process(process.pid)
        world = rospy.ServiceProxy("/gazebo/get_world_properties", GetWorldProperties)
        simulated, before, started, known = world().sim_time, watched.cpu_times(), time.monotonic(), scans
        time.sleep(seconds)
        simulated, after, wall = world().sim_time - simulated, watched.cpu_times(), time.monotonic() - started
        used = after.user + after.system - before.user - before.system
        found = {
            "CPU, %": 100 * used / wall,
            "real-time factor": simulated / wall,
            "per CPU second": simulated / used,
            "PSS, MB": watched.memory_full_info().pss / 1e6,
        }
        return found | ({"scans/s": (scans - known) / wall} if case.robots else {})
    finally:
        process.terminate()
        process.wait(20)


def measure_start(case: Case) -> dict[str, float]:
    """Return the time from the command `roslaunch` to the first scan."""
    import rospy
    from sensor_msgs.msg import LaserScan

    with tempfile.TemporaryDirectory() as folder:
        urdf, launch = Path(folder, "robot.urdf"), Path(folder, "robot.launch")
        urdf.write_text(robot())
        launch.write_text(
            f"""<launch>
              <include file="$(find gazebo_ros)/launch/empty_world.launch">
                <arg name="world_name" value="{case.world}"/><arg name="gui" value="false"/></include>
              <param name="robot_description" textfile="{urdf}"/>
              <node name="spawn" pkg="gazebo_ros" type="spawn_model" args="-urdf -param robot_description -model robot -x -2"/>
            </launch>"""
        )
        started = time.monotonic()
        process = subprocess.Popen([str(BIN / "roslaunch"), str(launch)], stdout=subprocess.DEVNULL)
        try:
            rospy.wait_for_message("/scan", LaserScan, 60)
            return {"first scan, s": time.monotonic() - started}
        finally:
            process.terminate()
            process.wait(30)


def run_node(profile: str, words: list[str]) -> int:
    """Run gzserver, and write a profile of the simulation's thread to a file if it has a name."""
    from minirospy.ros.gazebo_ros.gzserver import main as gzserver
    from minirospy.ros.gazebo_ros.loop import SimulationLoop

    profiler, run = cProfile.Profile(), SimulationLoop._run
    if profile:
        SimulationLoop._run = lambda loop: profiler.runcall(run, loop)
    status = gzserver("gzserver", [word for word in words if ":=" not in word])
    if profile:
        profiler.dump_stats(profile)
    return status


def measure_row(name: str, seconds: float, profile: str) -> list[str]:
    """Measure a case; return its row."""
    import rospy

    rospy.init_node("bench", disable_signals=True, disable_rostime=True)
    case = CASES[name]
    command = [sys.executable, __file__, "--node", profile]
    found = measure_start(case) if name == "start" else measure(case, seconds, command)
    return [case.name, case.target, *(f"{found[key]:.3g}" if key in found else "" for key in COLUMNS)]


def main() -> int:
    """Measure the cases; return the exit status."""
    if sys.argv[1:2] == ["--node"]:
        return run_node(sys.argv[2], sys.argv[3:])
    return measure_cases(__file__, __doc__, CASES, ("", "aim", *COLUMNS), measure_row)


if __name__ == "__main__":
    sys.exit(main())
