"""The controllers in a controller manager on the loopback: parameters on the server, services, and the joints of a URDF."""

from __future__ import annotations

import math

import pytest

from tests.ros.control.conftest import Run

ROBOT = """
from minirospy.core.control.loopback import LoopbackHardware
from minirospy.ros.controller_manager.manager import ControllerManager

wheel = '''<link name="%s"><collision><geometry><cylinder radius="0.1" length="0.05"/></geometry></collision></link>
<joint name="%s_joint" type="continuous"><parent link="base"/><child link="%s"/><origin xyz="0 %s 0"/><axis xyz="0 1 0"/>
</joint>'''
URDF = '<robot name="r"><link name="base"/>%s%s</robot>' % (
    wheel % ("left", "left", "left", 0.25), wheel % ("right", "right", "right", -0.25))

class Robot:
    def __init__(self, controllers):
        rospy.set_param("/robot_description", URDF)
        for name, values in controllers.items():
            rospy.set_param("/" + name, values)
        self.hardware = LoopbackHardware(parse_robot(URDF), [])
        self.manager = ControllerManager(self.hardware)
        self.nanoseconds = 100_000_000_000
    now = Rig.now
    show_time = Rig.show_time
    _clock = None
    def cycle(self, count=1):
        for _ in range(count):
            self.nanoseconds += 10_000_000
            period = rospy.Duration(0, 10_000_000)
            self.hardware.read(self.now, period)
            self.manager.update(self.now, period)
            self.hardware.write(self.now, period)
    def request(self, call, *arguments):
        answer = []
        thread = threading.Thread(target=lambda: answer.append(call(*arguments)))
        thread.start()
        while not answer:
            self.cycle()
            threading.Event().wait(0.001)
        thread.join()
        return answer[0]

COVARIANCE = {each + "_covariance_diagonal": [0.1] * 6 for each in ("pose", "twist")}
"""


def test_diff_drive_drives_a_circle_on_the_loopback(run: Run) -> None:
    shown = run(
        ROBOT
        + """
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
robot = Robot({
    "base": {"type": "diff_drive_controller/DiffDriveController", "left_wheel": "left_joint", "right_wheel": "right_joint",
             "cmd_vel_timeout": 100.0, "publish_rate": 50, **COVARIANCE},
    "states": {"type": "joint_state_controller/JointStateController", "publish_rate": 50},
})
loaded = [robot.request(robot.manager.load, name) for name in ("base", "states")]
started = robot.request(robot.manager.switch, ["base", "states"], [], 2)
base, states = (each.controller for each in robot.manager.table.loaded)
odom, joints = Received("/base/odom", Odometry), Received("/joint_states", JointState)
wait_until(lambda: base._odom._publisher.get_num_connections() and states._publisher._publisher.get_num_connections())
robot.show_time()
topic = Publisher("/base/cmd_vel", Twist)
topic.send(Twist(Vector3(0.5, 0, 0), Vector3(0, 0, 0.5)), lambda: base._command.linear == 0.5)
x, y, heading = base._odometry.x, base._odometry.y, base._odometry.heading
for _ in range(400):  # 4 pi s are 1256.6 cycles; the last fraction is a cycle of the odometry
    robot.cycle(3)
robot.cycle(57)
turn = base._odometry.heading - heading
gap = (base._odometry.x - x, base._odometry.y - y)
positions = [robot.hardware.joints[each].position for each in ("left_joint", "right_joint")]
odom.wait(11)
stopped = robot.request(robot.manager.switch, [], ["base"], 2)
robot.cycle()
velocities = [joint.velocity for joint in robot.hardware.joints.values()]
names = joints.wait().name
unloaded = robot.request(robot.manager.unload, "base")
show([loaded, started, turn, gap, positions, stopped, velocities, names, unloaded,
      "/base/odom" in dict(rospy.get_published_topics())])
""",
        is_simulated=True,
    )
    loaded, started, turn, gap, positions, stopped, velocities, names, unloaded, is_open = shown
    assert (loaded, started, stopped, unloaded) == ([True, True], True, True, True)
    cycles = 1257 - 1  # the first cycle commands the wheels, and the next one measures them
    assert turn == pytest.approx(cycles * 0.005, rel=1e-3)
    radius, circumference = 1.0, 2 * math.pi
    expected = (radius * math.sin(turn), radius * (1 - math.cos(turn)))
    assert math.dist(gap, expected) < 1e-3 * circumference
    assert math.hypot(*gap) < 2e-3 * circumference
    assert positions[1] - positions[0] == pytest.approx(1257 * 0.005 * 0.5 / 0.1, rel=1e-3)
    assert velocities == [0.0, 0.0]
    assert names == ["left_joint", "right_joint"]
    assert not is_open


def test_effort_controllers_reach_positions_on_the_loopback(run: Run) -> None:
    shown = run(
        ROBOT
        + """
from std_msgs.msg import Float64
robot = Robot({"pid": {"type": "effort_controllers/JointPositionController", "joint": "left_joint",
                       "pid": {"p": 100.0, "d": 20.0}}})
answers = [robot.request(robot.manager.load, "pid"), robot.request(robot.manager.switch, ["pid"], [], 2)]
controller = robot.manager.table.loaded[0].controller
topic = Publisher("/pid/command", Float64)
topic.send(Float64(6.0), lambda: controller._command.values[0] == 6.0)
robot.cycle(1000)
show([answers, robot.hardware.joints["left_joint"].position])
"""
    )
    answers, position = shown
    assert answers == [True, True]
    assert position == pytest.approx(6.0 - 2 * math.pi, abs=0.01)


def test_a_failed_load_leaves_no_topic(run: Run) -> None:
    shown = run(
        ROBOT
        + """
robot = Robot({
    "four": {"type": "four_wheel_steering_controller/FourWheelSteeringController"},
    "base": {"type": "diff_drive_controller/DiffDriveController", "left_wheel": "left_joint", "right_wheel": "x", **COVARIANCE},
    "pid": {"type": "effort_controllers/JointPositionController", "joint": "x", "pid": {"p": 1.0}},
    "gains": {"type": "effort_controllers/JointPositionController", "joint": "left_joint", "pid": {"i": 1.0}},
})
log = Logged()
answers = [robot.request(robot.manager.load, name) for name in ("four", "base", "pid", "gains")]
topics = [name for name, _ in rospy.get_published_topics() if not name.startswith("/rosout")]
show([answers, [line for line in log.lines if line.startswith("ERROR")], topics])
"""
    )
    answers, lines, topics = shown
    assert answers == [False] * 4
    assert topics == []
    assert [line for line in lines if "Initializing controller" in line] == [
        f"ERROR: Initializing controller '{name}' failed" for name in ("four", "base", "pid", "gains")
    ]
    assert "ERROR: x couldn't be retrieved from model description" in lines
    assert "ERROR: No p gain specified for pid.  Namespace: /gains/pid" in lines
    assert any("minirospy has no four wheel steering" in line for line in lines)
