"""The beginner tutorials of the ROS wiki, and those of tf2, with the same commands."""

from __future__ import annotations

import asyncio
import math
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from geometry_msgs.msg import Twist
from turtlesim.msg import Pose
from turtlesim.srv import TeleportAbsolute

from minirospy import Node
from tests.conftest import write_files
from tests.ros.robot_state_publisher.conftest import SECONDS, Start

BIN = Path(sys.executable).parent

SESSION = """
$ rosnode list
/my_turtle
$ rostopic type /turtle1/cmd_vel
geometry_msgs/Twist
$ rostopic pub -1 /turtle1/cmd_vel geometry_msgs/Twist -- '[2.0, 0.0, 0.0]' '[0.0, 0.0, 1.8]'
publishing and latching message for 3.0 seconds
$ rosservice type /clear
std_srvs/Empty
$ rosservice call /clear

$ rosservice type /spawn
turtlesim/Spawn
$ rossrv show turtlesim/Spawn
float32 x
float32 y
float32 theta
string name
---
string name

$ rosservice call /spawn 2 2 0.2 ""
name: "turtle2"
$ rosparam set /my_turtle/background_r 150
$ rosservice call /clear

$ rosparam get /my_turtle/background_g
86
$ rosparam dump params.yaml /my_turtle
$ rosparam load params.yaml copy_turtle
$ rosparam get /copy_turtle/background_b
255
$ rosmsg show turtlesim/Pose
float32 x
float32 y
float32 theta
float32 linear_velocity
float32 angular_velocity

$ rostopic echo -n1 /turtle2/color_sensor
r: 150
g: 86
b: 255
---
"""

TURTLEMIMIC = """
<launch>

  <group ns="turtlesim1">
    <node pkg="turtlesim" name="sim" type="turtlesim_node"/>
  </group>

  <group ns="turtlesim2">
    <node pkg="turtlesim" name="sim" type="turtlesim_node"/>
  </group>

  <node pkg="turtlesim" name="mimic" type="mimic">
    <remap from="input" to="turtlesim1/turtle1"/>
    <remap from="output" to="turtlesim2/turtle1"/>
  </node>

</launch>
"""

LEARNING_TF2 = {
    "package.xml": """<package format="2"><name>learning_tf2</name><version>0.0.1</version>
<description>Tutorial.</description><maintainer email="a@b.org">A</maintainer><license>BSD</license></package>""",
    "nodes/turtle_tf2_broadcaster.py": """#!/usr/bin/env python3
import rospy

# Because of transformations
import tf_conversions

import tf2_ros
import geometry_msgs.msg
import turtlesim.msg


def handle_turtle_pose(msg, turtlename):
    br = tf2_ros.TransformBroadcaster()
    t = geometry_msgs.msg.TransformStamped()

    t.header.stamp = rospy.Time.now()
    t.header.frame_id = "world"
    t.child_frame_id = turtlename
    t.transform.translation.x = msg.x
    t.transform.translation.y = msg.y
    t.transform.translation.z = 0.0
    q = tf_conversions.transformations.quaternion_from_euler(0, 0, msg.theta)
    t.transform.rotation.x = q[0]
    t.transform.rotation.y = q[1]
    t.transform.rotation.z = q[2]
    t.transform.rotation.w = q[3]

    br.sendTransform(t)

if __name__ == '__main__':
    rospy.init_node('tf2_turtle_broadcaster')
    turtlename = rospy.get_param('~turtle')
    rospy.Subscriber('/%s/pose' % turtlename,
                     turtlesim.msg.Pose,
                     handle_turtle_pose,
                     turtlename)
    rospy.spin()
""",
    "nodes/turtle_tf2_listener.py": """#!/usr/bin/env python3
import rospy

import math
import tf2_ros
import geometry_msgs.msg
import turtlesim.srv

if __name__ == '__main__':
    rospy.init_node('tf2_turtle_listener')

    tfBuffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(tfBuffer)

    rospy.wait_for_service('spawn')
    spawner = rospy.ServiceProxy('spawn', turtlesim.srv.Spawn)
    turtle_name = rospy.get_param('turtle', 'turtle2')
    spawner(4, 2, 0, turtle_name)

    turtle_vel = rospy.Publisher('%s/cmd_vel' % turtle_name, geometry_msgs.msg.Twist, queue_size=1)

    rate = rospy.Rate(10.0)
    while not rospy.is_shutdown():
        try:
            trans = tfBuffer.lookup_transform(turtle_name, 'turtle1', rospy.Time())
        except (tf2_ros.LookupException, tf2_ros.ConnectivityException, tf2_ros.ExtrapolationException):
            rate.sleep()
            continue

        msg = geometry_msgs.msg.Twist()

        msg.angular.z = 4 * math.atan2(trans.transform.translation.y, trans.transform.translation.x)
        msg.linear.x = 0.5 * math.sqrt(trans.transform.translation.x ** 2 + trans.transform.translation.y ** 2)

        turtle_vel.publish(msg)

        rate.sleep()
""",
    "launch/start_demo.launch": """
  <launch>
     <node pkg="turtlesim" type="turtlesim_node" name="sim"/>

    <node pkg="turtlesim" type="turtle_teleop_key" name="teleop" output="screen"/>
    <!-- Axes -->
    <param name="scale_linear" value="2" type="double"/>
    <param name="scale_angular" value="2" type="double"/>

    <node name="turtle1_tf2_broadcaster" pkg="learning_tf2" type="turtle_tf2_broadcaster.py" respawn="false" output="screen" >
      <param name="turtle" type="string" value="turtle1" />
    </node>
    <node name="turtle2_tf2_broadcaster" pkg="learning_tf2" type="turtle_tf2_broadcaster.py" respawn="false" output="screen" >
      <param name="turtle" type="string" value="turtle2" />
    </node>
    <node pkg="learning_tf2" type="turtle_tf2_listener.py"
          name="listener" output="screen"/>
  </launch>
""",
}

Launch = Callable[..., None]


@pytest.fixture
def launch(master: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Launch]:
    """Start `roslaunch WORDS`; stop it after the test, and assert that it has not printed a traceback."""
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    with ExitStack() as running:

        def run(*words: str, stdin: int = subprocess.DEVNULL) -> None:
            log = running.enter_context((tmp_path / "roslaunch.txt").open("w+"))
            process = subprocess.Popen([str(BIN / "roslaunch"), *words], stdin=stdin, stdout=log, stderr=log)
            running.callback(finish, process, tmp_path / "roslaunch.txt")

        yield run


def finish(process: subprocess.Popen[bytes], log: Path) -> None:
    process.terminate()
    try:
        process.wait(SECONDS)
    finally:
        process.kill()
    assert "Traceback" not in log.read_text()


async def until(node: Node, topic: str, is_right: Callable[[Pose], bool]) -> Pose:
    async for pose in node.subscribe(topic, Pose):
        if is_right(pose):
            return pose
    raise AssertionError


def test_beginner_tutorials_print_what_the_wiki_shows(start: Start, tmp_path: Path) -> None:
    start("turtlesim", "turtlesim_node", "__name:=my_turtle")

    async def wait() -> None:
        async with Node("test", rosout=False) as node:
            await node.wait_for_service("turtle1/teleport_absolute", timeout=SECONDS)

    asyncio.run(wait())
    shown = ""
    for line in SESSION.splitlines(keepends=True):
        if line.startswith("$ "):
            shown += line + typed(line[2:], tmp_path)
    assert shown == SESSION.lstrip("\n")


def typed(line: str, folder: Path) -> str:
    """Return a command's output."""
    program, *words = shlex.split(line)
    done = subprocess.run(
        [str(BIN / program), *words],
        capture_output=True,
        text=True,
        cwd=folder,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
        timeout=SECONDS,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_turtlemimic_launch_lets_one_world_copy_the_other(launch: Launch, tmp_path: Path) -> None:
    (tmp_path / "turtlemimic.launch").write_text(TURTLEMIMIC)
    launch(str(tmp_path / "turtlemimic.launch"))

    async def main() -> None:
        async with Node("test", rosout=False) as node:
            commands = node.advertise("/turtlesim1/turtle1/cmd_vel", Twist)
            twist = Twist()
            twist.linear.x, twist.angular.z = 2.0, -1.8
            copied = asyncio.ensure_future(
                until(node, "/turtlesim2/turtle1/pose", lambda pose: pose.linear_velocity == 2.0)
            )
            while not copied.done():
                # `rostopic pub -r` does the same.
                await commands.publish(twist)
                await asyncio.wait({copied}, timeout=0.2)
            assert copied.result().angular_velocity == pytest.approx(-1.8)

    asyncio.run(asyncio.wait_for(main(), SECONDS))


@pytest.mark.parametrize(
    "words",
    [
        ("learning_tf2", "start_demo.launch"),
        ("turtle_tf2", "turtle_tf2_demo.launch"),
        ("turtle_tf", "turtle_tf_demo.launch"),
    ],
    ids=lambda words: words[0],
)
def test_second_turtle_follows_the_first(launch: Launch, tmp_path: Path, words: tuple[str, str]) -> None:
    nodes = [name for name in LEARNING_TF2 if name.startswith("nodes/")]
    write_files(tmp_path / "learning_tf2", LEARNING_TF2, nodes)
    launch(*words)

    async def main() -> None:
        async with Node("test", rosout=False) as node:
            await until(node, "turtle2/pose", lambda pose: pose.linear_velocity > 0)
            await node.call("turtle1/teleport_absolute", TeleportAbsolute, x=9, y=9)
            await until(node, "turtle2/pose", lambda pose: math.dist((pose.x, pose.y), (9, 9)) < 1)

    asyncio.run(asyncio.wait_for(main(), SECONDS))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
@pytest.mark.parametrize("package", ["turtle_tf2", "turtle_tf"])
def test_arrow_keys_in_roslaunchs_terminal_drive_the_turtle(launch: Launch, package: str) -> None:
    terminal, stdin = os.openpty()
    launch(package, f"{package}_demo.launch", stdin=stdin)

    async def main() -> None:
        async with Node("test", rosout=False) as node:
            driven = asyncio.ensure_future(until(node, "turtle1/pose", lambda pose: pose.linear_velocity > 0))
            while not driven.done():
                os.write(terminal, b"\x1b[A")
                await asyncio.wait({driven}, timeout=0.2)
            driven.result()

    try:
        asyncio.run(asyncio.wait_for(main(), SECONDS))
    finally:
        os.close(terminal)
        os.close(stdin)
