"""diff_drive_controller and ackermann_steering_controller: odometry, limits, timeout, bad input, texts and topics."""

from __future__ import annotations

import math

import pytest

from tests.ros.control.conftest import Run

BASE = """
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

VALUES = {
    "left_wheel": ["l1", "l2"], "right_wheel": ["r1", "r2"], "wheel_separation": 0.5, "wheel_radius": 0.1,
    "pose_covariance_diagonal": [0.1, 0.2, 0.3, 4, 5, 6.0], "twist_covariance_diagonal": [1, 2, 3, 4, 5, 6],
}
ACKERMANN = {
    **VALUES, "rear_wheel": "rear", "front_steer": "front", "wheel_separation_h": 1.5, "wheel_radius": 0.3,
}
DIFF_DRIVE = "diff_drive_controller/DiffDriveController"
STEERED = "ackermann_steering_controller/AckermannSteeringController"

def diff_drive(urdf="", **values):
    return Rig(DIFF_DRIVE, {**VALUES, **values}, "l1 l2 r1 r2", urdf)

class Driver:
    def __init__(self, rig):
        self.rig = rig
        self.topic = Publisher("/c/cmd_vel", Twist)
    def send(self, linear, angular, has_arrived=None):
        self.rig.show_time()
        before = self.rig.controller._command
        self.topic.send(Twist(Vector3(linear, 0, 0), Vector3(0, 0, angular)),
                        has_arrived or (lambda: self.rig.controller._command is not before))
    def cycle(self, count=1, milliseconds=10):
        for _ in range(count):
            self.rig.cycle(1, milliseconds)
            for joint in self.rig.hardware.joints.values():
                joint.velocity = joint.velocity_command
                joint.position += joint.velocity_command * milliseconds / 1000

def speeds(rig):
    return [round(joint.velocity_command, 9) for joint in rig.hardware.joints.values()]

def pose(rig):
    odometry = rig.controller._odometry
    return [odometry.x, odometry.y, odometry.heading, odometry.linear, odometry.angular]
"""


def test_diff_drive_drives_a_circle_that_closes(run: Run) -> None:
    shown = run(
        BASE
        + """
rig = diff_drive(publish_rate=20)
odom, transforms = Received("/c/odom", Odometry), Received("/tf", TFMessage)
wait_until(lambda: rig.controller._odom._publisher.get_num_connections() and rig.controller._tf._publisher.get_num_connections())
rig.start()
driver = Driver(rig)
poses = []
for _ in range(40):
    driver.send(1.0, 3.14159265358979 / 2)
    driver.cycle(10)
    poses.append(pose(rig))
driver.cycle()
wheels = speeds(rig)
poses.append(pose(rig))
message, transform = odom.messages[0], transforms.wait().transforms[0]
rig.controller.stopping(rig.now)
rig.controller.close()
show([poses[9], poses[19], poses[-1], wheels, speeds(rig), len(odom.messages),
      [message.header.frame_id, message.child_frame_id, message.header.stamp.to_sec()],
      list(message.pose.covariance), list(message.twist.covariance)[::7],
      [transform.header.frame_id, transform.child_frame_id, transform.transform.rotation.w ** 2
       + transform.transform.rotation.z ** 2]])
""",
        is_simulated=True,
    )
    quarter, half, whole, wheels, stopped, count, frames, covariance, twist_covariance, transform = shown
    radius = 2.0 / math.pi
    # The first cycle commands the wheels, so the odometry is one cycle behind.
    turn = math.pi / 2 * 0.99
    assert quarter[:3] == pytest.approx(
        [radius * math.sin(turn), radius * (1 - math.cos(turn)), turn], rel=1e-3
    )
    assert half[2] == pytest.approx(math.pi / 2 * 1.99, rel=1e-3)
    assert math.hypot(whole[0], whole[1]) < 1e-3 * 2 * math.pi * radius
    assert whole[2:] == pytest.approx([2 * math.pi, 1.0, math.pi / 2], rel=1e-3)
    side = math.pi / 2 * 0.25
    assert wheels == pytest.approx([(1 - side) / 0.1] * 2 + [(1 + side) / 0.1] * 2)
    assert stopped == [0.0] * 4
    assert 75 <= count <= 81
    assert frames == ["odom", "base_link", pytest.approx(100.06)]
    assert covariance == [[0.1, 0.2, 0.3, 4, 5, 6][k // 7] if k % 7 == 0 else 0.0 for k in range(36)]
    assert twist_covariance == [1, 2, 3, 4, 5, 6]
    assert transform == ["odom", "base_link", pytest.approx(1.0)]


def test_diff_drive_stops_by_the_timeout_within_its_limits(run: Run) -> None:
    shown = run(
        BASE
        + """
limits = {"x": {"has_velocity_limits": True, "max_velocity": 0.5, "has_acceleration_limits": True, "max_acceleration": 1.0}}
rig = diff_drive(linear=limits, cmd_vel_timeout=0.25, publish_cmd=True)
from geometry_msgs.msg import TwistStamped
out = Received("/c/cmd_vel_out", TwistStamped)
wait_until(lambda: rig.controller._cmd_vel_out._publisher.get_num_connections())
rig.start()
driver = Driver(rig)
seen = []
driver.send(9.0, 0.0)
for cycle in range(1, 61):
    driver.cycle()
    seen.append(speeds(rig)[0] * 0.1)
last = out.wait(60)
rig.controller.close()
show([seen, last.twist.linear.x, last.header.stamp.to_sec()])
""",
        is_simulated=True,
    )
    seen, last, stamp = shown
    up = [0.01 * cycle for cycle in range(1, 26)]
    assert seen == pytest.approx([*up, *up[-2::-1], *[0.0] * 11], abs=1e-9)
    assert (last, stamp) == (0.0, pytest.approx(100.6))


def test_bad_commands_are_ignored_and_the_base_stops(run: Run) -> None:
    shown = run(
        BASE
        + """
rig = diff_drive(allow_multiple_cmd_vel_publishers=False)
log = Logged()
driver = Driver(rig)
driver.send(1.0, 0.0, log.has(1))
rig.start()
driver.send(1.0, 0.0)
driver.cycle()
seen = [speeds(rig)[0]]
for number in range(6):
    driver.send(float("nan") if number % 2 else 1.0, float("inf"), (log.has(2) if number == 0 else lambda: True))
    driver.cycle(10)
    seen.append(speeds(rig)[0])
driver.send(1.0, 0.0)
driver.cycle()
rig.joint("l2").position = float("nan")
before = pose(rig)
driver.rig.cycle()
seen.append(speeds(rig)[0])
rig.joint("l2").position = rig.joint("l1").position
driver.cycle()
seen.append(speeds(rig)[0])
other = Publisher("/c/cmd_vel", Twist)
import subprocess, sys
second = subprocess.Popen([sys.executable, "-c", "import rospy; from geometry_msgs.msg import Twist; rospy.init_node('second');"
    "p = rospy.Publisher('/c/cmd_vel', Twist, queue_size=1); print(flush=True); input()"],
    stdin=subprocess.PIPE, stdout=subprocess.PIPE)
second.stdout.readline()
wait_until(lambda: rig.controller._subscriber.get_num_connections() > 1)
driver.send(1.0, 0.0, log.has(3))
driver.cycle()
seen.append(speeds(rig)[0])
second.communicate(b"\\n")
rig.controller.close()
show([seen, log.lines])
""",
        is_simulated=True,
    )
    seen, lines = shown
    assert seen == [10.0, 10.0, 10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 10.0, 0.0]
    assert lines == [
        "ERROR: Can't accept new commands. Controller is not running.",
        "WARNING: Received NaN in velocity command. Ignoring.",
        "ERROR: Detected 2 publishers. Only 1 publisher is allowed. Going to brake.",
    ]


def test_time_backwards_stops_the_base_and_goes_on_publishing(run: Run) -> None:
    shown = run(
        BASE
        + """
rig = diff_drive()
odom = Received("/c/odom", Odometry)
wait_until(lambda: rig.controller._odom._publisher.get_num_connections())
rig.start()
driver = Driver(rig)
driver.send(1.0, 0.0)
driver.cycle(10)
before, count = pose(rig), len(odom.messages)
rig.nanoseconds = 10_000_000_000
driver.cycle()
after, stopped = pose(rig), speeds(rig)
driver.cycle(10)
odom.wait(count + 3)
driver.send(2.0, 0.0)
driver.cycle()
moving = speeds(rig)[0]
rig.controller.close()
show([before[0], after[0], stopped, moving, odom.messages[-1].header.stamp.to_sec() < 11])
""",
        is_simulated=True,
    )
    assert shown == [pytest.approx(0.09), pytest.approx(0.1), [0.0] * 4, 20.0, True]


def test_a_restart_begins_at_rest(run: Run) -> None:
    shown = run(
        BASE
        + """
rig = diff_drive(linear={"x": {"has_acceleration_limits": True, "max_acceleration": 1.0}})
rig.start()
driver = Driver(rig)
driver.send(1.0, 0.0)
driver.cycle(40)
moving = speeds(rig)[0]
rig.controller.stopping(rig.now)
rig.start()
driver.cycle()
show([moving, speeds(rig)])
rig.controller.close()
""",
        is_simulated=True,
    )
    assert shown == [pytest.approx(4.0), [0.0] * 4]


def test_open_loop_odometry_follows_the_commands(run: Run) -> None:
    shown = run(
        BASE
        + """
rig = diff_drive(open_loop=True, cmd_vel_timeout=5.0, linear={"x": {"has_velocity_limits": True, "max_velocity": 0.5}})
rig.start()
driver = Driver(rig)
driver.send(1.0, 0.5)
for _ in range(101): rig.cycle()
rig.controller.close()
show(pose(rig))
""",
        is_simulated=True,
    )
    assert shown == pytest.approx([math.sin(0.5), 1 - math.cos(0.5), 0.5, 0.5, 0.5], rel=1e-3)


def test_dynamic_reconfigure_changes_the_geometry(run: Run) -> None:
    shown = run(
        BASE
        + """
from dynamic_reconfigure.client import Client
rig = diff_drive(wheel_radius_multiplier=1.1, enable_odom_tf=False, publish_rate=25)
rig.start()
client = Client("/c", timeout=30)
first = client.get_configuration()
log = Logged()
client.update_configuration({"left_wheel_radius_multiplier": 0.8, "wheel_separation_multiplier": 9.0})
driver = Driver(rig)
driver.send(1.0, 1.0)
driver.cycle()
described = client.get_parameter_descriptions()
client.update_configuration({"wheel_separation_multiplier": float("nan")})
rig.controller.close()
show([{name: first[name] for name in rig.controller._config}, speeds(rig), log.lines, rig.controller._config,
      [[each["name"], each["min"], each["max"], each["default"]] for each in described]])
""",
        is_simulated=False,
    )
    first, wheels, lines, last, described = shown
    assert first == {
        "left_wheel_radius_multiplier": 1.1,
        "right_wheel_radius_multiplier": 1.1,
        "wheel_separation_multiplier": 1.0,
        "publish_rate": 25.0,
        "enable_odom_tf": False,
    }
    assert wheels == pytest.approx([(1 - 0.375) / 0.08] * 2 + [(1 + 0.375) / 0.11] * 2)
    assert lines == [
        "INFO: Dynamic Reconfigure:\nDynamicParams:\n\tOdometry parameters:\n\t\tleft wheel radius multiplier: 0.8\n"
        "\t\tright wheel radius multiplier: 1.1\n\t\twheel separation multiplier: 1.5\n\tPublication parameters:\n"
        "\t\tPublish executed velocity command: disabled\n\t\tPublication rate: 25\n"
        "\t\tPublish frame odom on tf: disabled"
    ]
    assert last == {**first, "left_wheel_radius_multiplier": 0.8, "wheel_separation_multiplier": 1.5}
    assert described == [
        ["left_wheel_radius_multiplier", 0.5, 1.5, 1.0],
        ["right_wheel_radius_multiplier", 0.5, 1.5, 1.0],
        ["wheel_separation_multiplier", 0.5, 1.5, 1.0],
        ["publish_rate", 0.0, 2000.0, 50.0],
        ["enable_odom_tf", False, True, True],
    ]


def test_parameters_and_geometry_have_the_texts_of_ros(run: Run) -> None:
    shown = run(
        BASE
        + """
def robot(left="", right=""):
    return f'''<robot name="r"><link name="base"/><link name="l">{left}</link><link name="r">{right}</link>
      <joint name="l1" type="continuous"><parent link="base"/><child link="l"/><origin xyz="0 0.3 0.1"/></joint>
      <joint name="r1" type="continuous"><parent link="base"/><child link="r"/><origin xyz="0 -0.2 0.1"/></joint></robot>'''

shape = "<collision><geometry>%s</geometry></collision>"
cylinder, sphere, box = (shape % each for each in
    ('<cylinder radius="0.125" length="0.1"/>', '<sphere radius="0.25"/>', '<box size="1 1 1"/>'))
def load(urdf="", without=(), **values):
    log.lines.clear()
    values = {name: value for name, value in {**VALUES, **values}.items() if name not in without}
    try:
        rig = Rig(DIFF_DRIVE, values, "l1 l2 r1 r2", urdf)
    except ControllerError as error:
        return [*(line for line in log.lines if not line.startswith("INFO")), str(error)]
    rig.controller.close()
    return log.lines[:]

log = Logged()
one = dict(left_wheel="l1", right_wheel="r1")
both = ("wheel_separation", "wheel_radius")
show([
    load(**one), load(robot(cylinder), both, **one)[-4:],
    load(robot(sphere), ["wheel_radius"], **one)[-2:],
    *(load(without=[name]) for name in ("left_wheel", "right_wheel", "pose_covariance_diagonal")),
    load(left_wheel=[]), load(left_wheel=5), load(right_wheel=["r1", 2]), load(left_wheel=["l1"]),
    load(twist_covariance_diagonal=[1.0] * 5), load(wheel_radius=0),
    load(without=both), load(robot(box), both, **one), load(robot(), both, **one),
    load(robot(), both, left_wheel="x", right_wheel="r1"),
    failure(lambda: diff_drive(left_wheel=["x"], right_wheel=["r1"])),
])
"""
    )
    assert shown[0] == [
        "INFO: Controller state will be published at 50Hz.",
        "INFO: Wheel separation will be multiplied by 1.",
        "INFO: Left wheel radius will be multiplied by 1.",
        "INFO: Right wheel radius will be multiplied by 1.",
        "INFO: Velocity rolling window size of 10.",
        "INFO: Velocity commands will be considered old if they are older than 0.5s.",
        "INFO: Allow mutiple cmd_vel publishers is enabled",
        "INFO: Base frame_id set to base_link",
        "INFO: Odometry frame_id set to odom",
        "INFO: Publishing to tf is enabled",
        "INFO: Odometry params : wheel separation 0.5, left wheel radius 0.1, right wheel radius 0.1",
        "INFO: Adding left wheel with joint name: l1 and right wheel with joint name: r1",
    ]
    assert shown[1] == [
        "INFO: left wheel to origin: 0,0.3, 0.1",
        "INFO: right wheel to origin: 0,-0.2, 0.1",
        "INFO: Odometry params : wheel separation 0.5, left wheel radius 0.125, right wheel radius 0.125",
        "INFO: Adding left wheel with joint name: l1 and right wheel with joint name: r1",
    ]
    assert shown[2][0].endswith("wheel separation 0.5, left wheel radius 0.25, right wheel radius 0.25")
    not_modeled = "ERROR: Wheel link l is NOT modeled as a cylinder or sphere!"
    assert shown[3:] == [
        ["Couldn't retrieve wheel param 'left_wheel'."],
        ["Couldn't retrieve wheel param 'right_wheel'."],
        ["Parameter '/c/pose_covariance_diagonal' must be a list of 6 numbers"],
        ["Wheel param 'left_wheel' is an empty list"],
        ["Wheel param 'left_wheel' is neither a list of strings nor a string."],
        ["Wheel param 'right_wheel' #1 isn't a string."],
        ["#left wheels (1) != #right wheels (2)."],
        ["Parameter '/c/twist_covariance_diagonal' must be a list of 6 numbers"],
        ["wheel_separation, wheel_radius and their multipliers must not be 0"],
        [
            "ERROR: Could not find parameter robot_description on parameter server",
            "Robot description couldn't be retrieved from param server.",
        ],
        [not_modeled, "Couldn't retrieve l1 wheel radius"],
        [
            "ERROR: Link l does not have collision description. Add collision description for link to urdf.",
            not_modeled,
            "Couldn't retrieve l1 wheel radius",
        ],
        ["x couldn't be retrieved from model description"],
        "Could not find resource 'x' in 'hardware_interface::VelocityJointInterface'.",
    ]


def test_the_state_of_the_wheels_is_published(run: Run) -> None:
    shown = run(
        BASE
        + """
from control_msgs.msg import JointTrajectoryControllerState
rig = diff_drive(publish_wheel_joint_controller_state=True)
states = Received("/c/wheel_joint_controller_state", JointTrajectoryControllerState)
wait_until(lambda: rig.controller._wheel_states._publisher._publisher.get_num_connections())
rig.start()
driver = Driver(rig)
driver.send(1.0, 2.0)
driver.cycle(2)
m = states.wait(2)
rig.controller.close()
show([m.joint_names, *(str([list(getattr(part, name)) for name in ("positions", "velocities", "accelerations", "effort")])
                       for part in (m.desired, m.actual, m.error))])
""",
        is_simulated=True,
    )
    names, desired, actual, error = shown
    assert names == ["l1", "l2", "r1", "r2"]
    zero, nan = [0.0] * 4, [math.nan] * 4
    assert desired == str([[0.1, 0.1, 0.3, 0.3], [5.0, 5.0, 15.0, 15.0], zero, nan])
    assert actual == str(
        [[0.05, 0.05, 0.15, 0.15], [5.0, 5.0, 15.0, 15.0], [500.0, 500.0, 1500.0, 1500.0], zero]
    )
    assert error == str([[0.05, 0.05, 0.15, 0.15], zero, [-500.0, -500.0, -1500.0, -1500.0], nan])


def test_ackermann_steers_along_arcs(run: Run) -> None:
    shown = run(
        BASE
        + """
rig = Rig(STEERED, {**ACKERMANN, "steer_pos_multiplier": 2.0, "cmd_vel_timeout": 10.0}, "rear front")
rig.start()
driver = Driver(rig)
driver.send(1.2, 0.25)
for _ in range(101):
    rig.cycle()
    rig.joint("front").position = rig.joint("front").position_command
    rig.joint("rear").position += rig.joint("rear").velocity_command * 0.01
commands = [rig.joint("rear").velocity_command, rig.joint("front").position_command]
claims = [(each.interface, each.resources) for each in rig.resources.claimed(rig.controller.interfaces)]
seen = pose(rig)
rig.controller.stopping(rig.now)
rig.controller.close()
show([seen, commands, [rig.joint("rear").velocity_command, rig.joint("front").position_command], claims])
""",
        is_simulated=True,
    )
    seen, commands, stopped, claims = shown
    turn = 1.2 * math.tan(0.5) / 1.5
    radius = 1.5 / math.tan(0.5)
    assert seen == pytest.approx(
        [radius * math.sin(turn), radius * (1 - math.cos(turn)), turn, 1.2, turn], rel=1e-3
    )
    assert commands == [pytest.approx(4.0), 0.25]
    assert stopped == [0.0, 0.0]
    assert claims == [
        ["hardware_interface::PositionJointInterface", ["front"]],
        ["hardware_interface::VelocityJointInterface", ["rear"]],
    ]


def test_ackermann_finds_its_geometry_and_four_wheel_steering_says_what_is_missing(run: Run) -> None:
    shown = run(
        BASE
        + """
urdf = '''<robot name="r"><link name="base"/><link name="w"><collision><geometry><cylinder radius="0.2" length="0.1"/>
</geometry></collision></link><link name="s"/>
<joint name="rear" type="continuous"><parent link="base"/><child link="w"/><origin xyz="-0.5 0 0.1"/></joint>
<joint name="front" type="continuous"><parent link="base"/><child link="s"/><origin xyz="0.75 0 0.1"/></joint></robot>'''
values = {name: value for name, value in ACKERMANN.items() if name not in ("wheel_separation_h", "wheel_radius")}
log = Logged()
Rig(STEERED, values, "rear front", urdf).controller.close()
show([log.lines[-9:], failure(lambda: Rig(STEERED, values, "rear front")),
      failure(lambda: Rig(STEERED, {**ACKERMANN, "rear_wheel": "x"}, "rear front")),
      failure(lambda: Rig(STEERED, {**ACKERMANN, "wheel_separation_h": 0}, "rear front")),
      failure(lambda: Rig("four_wheel_steering_controller/FourWheelSteeringController", {}, "a"))])
"""
    )
    assert shown[0] == [
        "INFO: rear wheel to origin: -0.5,0, 0.1",
        "INFO: front steer to origin: 0.75,0, 0.1",
        "INFO: Calculated wheel_separation_h: 1.25",
        "INFO: Retrieved wheel_radius: 0.2",
        "INFO: Odometry params : wheel separation height 1.25, wheel radius 0.2",
        "INFO: Adding the rear wheel with joint name: rear",
        "INFO: Adding the front steer with joint name: front",
        "INFO: Adding the subscriber: cmd_vel",
        "INFO: Finished controller initialization",
    ]
    assert shown[1:4] == [
        "Robot descripion couldn't be retrieved from param server.",
        "Could not find resource 'x' in 'hardware_interface::VelocityJointInterface'.",
        "wheel_separation_h, wheel_radius and their multipliers must not be 0",
    ]
    assert shown[4].startswith("controller 'c': minirospy has no four wheel steering")
