"""JointTrajectoryController with its topics, its service and actionlib's clients; the program holds the time."""

from __future__ import annotations

import pytest

from tests.ros.control.conftest import Run

BEGIN = """
import actionlib, math
from control_msgs.msg import (FollowJointTrajectoryAction, FollowJointTrajectoryGoal, JointTolerance,
                              JointTrajectoryControllerState)
from control_msgs.srv import QueryTrajectoryState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
URDF = (
    "<robot name='r'><link name='0'/><link name='1'/><link name='2'/>"
    "<joint name='a' type='continuous'><parent link='0'/><child link='1'/></joint>"
    "<joint name='b' type='revolute'><parent link='1'/><child link='2'/>"
    "<limit lower='-9' upper='9' effort='1' velocity='1'/></joint></robot>"
)
KIND = "position_controllers/JointTrajectoryController"
USUAL = {"joints": ["a", "b"], "state_publish_rate": 10, "action_monitor_rate": 10}
def make_trajectory(*points, names=("a", "b"), stamp=0.0):
    made = [JointTrajectoryPoint(positions=each[0], time_from_start=rospy.Duration.from_sec(each[1])) for each in points]
    message = JointTrajectory(joint_names=list(names), points=made)
    message.header.stamp = rospy.Time.from_sec(stamp)
    return message
def make_goal(*points, **more):
    return FollowJointTrajectoryGoal(trajectory=make_trajectory(*points, **more))
def refusal(call):
    try:
        call()
    except rospy.ServiceException as error:
        return str(error)
class Arm(Rig):
    # the joints reach what the controller desires
    def __init__(self, parameters={}, kind=KIND, start=True):
        super().__init__(kind, {**USUAL, **parameters}, "a b", URDF)
        self.client = actionlib.SimpleActionClient("/c/follow_joint_trajectory", FollowJointTrajectoryAction)
        assert self.client.wait_for_server(rospy.Duration(30))
        self.feedback = []
        if start:
            self.start()
    def run(self, cycles=1):
        for _ in range(cycles):
            self.cycle()
            for joint, velocity in zip(self.controller.joints, self.controller.follower.velocities):
                joint.position, joint.velocity = joint.position_command, velocity
    def positions(self):
        return [round(self.joint(name).position_command, 6) for name in "ab"]
    def send(self, *points, **more):
        self.client.send_goal(make_goal(*points, **more), feedback_cb=self.feedback.append)
        wait_until(lambda: self.client.get_state() != 0)
    def outcome(self):
        assert self.client.wait_for_result(rospy.Duration(30))
        result = self.client.get_result()
        return [self.client.get_state(), result.error_code, result.error_string]
"""


@pytest.fixture
def run(run: Run) -> Run:
    """Return a function that runs a program with the tools of this module."""
    return lambda body: run(BEGIN + body)


def test_a_goal_is_executed_and_succeeds_at_the_monitor_rate(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 0.55))
arm.run(51)
halfway = arm.client.get_state()
wait_until(lambda: len(arm.feedback) == 5)
arm.run(9)
early = arm.client.get_state()
arm.run(1)
feedback = arm.feedback[1]
show([halfway, early, arm.outcome(), arm.positions(), feedback.joint_names,
      [round(value, 6) for value in feedback.desired.positions], feedback.header.stamp.to_sec(),
      round(feedback.actual.time_from_start.to_sec(), 6)])
""")
    halfway, early, outcome, positions, names, desired, stamp, elapsed = shown
    assert (halfway, early) == (1, 1)
    assert outcome == [3, 0, ""]
    assert positions == [1.0, -1.0]
    assert names == ["a", "b"]
    assert desired == pytest.approx([4 / 11, -4 / 11])
    assert (stamp, elapsed) == (100.21, 0.2)


WRONG_GOALS = [
    ("make_goal(([0, 0, 0], 1), names='abc')", -2, ""),
    ("make_goal(([0], 1), names='a')", -2, ""),
    ("make_goal(([0, 0], 1), names='ax')", -2, ""),
    ("make_goal(([0, 0], 1), names='aa')", -2, ""),
    ("make_goal(names='x')", -2, ""),
    (
        "make_goal(([0, 0], 1), ([0, 0], 1))",
        -1,
        "Trajectory message contains waypoints that are not strictly increasing in time.",
    ),
    (
        "make_goal(([0, 0], 1), stamp=50)",
        -1,
        "Dropping all 1 trajectory point(s), as they occur before the current time.\n"
        "Last point is 49.110000s in the past.",
    ),
    (
        "make_goal(([math.nan, 0], 1))",
        -1,
        "Invalid trajectory point at index: 0. The position of joint 'a' is nan, which is not a usable number.",
    ),
    (
        "make_goal(([0], 1))",
        -1,
        "Invalid trajectory point at index: 0. "
        "Size mismatch in joint names, position, velocity or acceleration data.",
    ),
]


def test_wrong_goals_are_rejected_and_the_running_one_goes_on(run: Run) -> None:
    goals = ", ".join(goal for goal, _, _ in WRONG_GOALS)
    shown = run(f"""
arm = Arm()
arm.send(([1.0, -1.0], 0.5))
arm.run(10)
other = actionlib.SimpleActionClient("/c/follow_joint_trajectory", FollowJointTrajectoryAction)
assert other.wait_for_server(rospy.Duration(30))
logged, outcomes = Logged(), []
for goal in [{goals}]:
    other.send_goal(goal)
    assert other.wait_for_result(rospy.Duration(30))
    result = other.get_result()
    lines = [line for line in logged.lines if line.startswith(("ERROR", "WARN"))]
    outcomes.append([other.get_state(), result.error_code, result.error_string, lines])
    logged.lines.clear()
arm.run(55)
show([outcomes, arm.outcome(), arm.positions()])
""")
    outcomes, outcome, positions = shown
    joints = "Joints on incoming goal don't match the controller joints."
    for found, (_, code, text) in zip(outcomes, WRONG_GOALS, strict=True):
        level = "WARNING" if "Dropping" in text else "ERROR"
        assert found == [5, code, text, [f"{level}: {text or joints}"]]
    assert (outcome, positions) == ([3, 0, ""], [1.0, -1.0])


def test_goals_and_commands_are_refused_unless_it_runs(run: Run) -> None:
    shown = run("""
arm = Arm(start=False)
logged = Logged()
arm.send(([1.0, -1.0], 0.5))
first = arm.outcome()
Publisher("/c/command", JointTrajectory).send(make_trajectory(([1.0, 1.0], 1)), logged.has(2))
query = rospy.ServiceProxy("/c/query_state", QueryTrajectoryState)
show([first, refusal(lambda: query(rospy.Time(100))), logged.lines])
""")
    outcome, refusal, lines = shown
    assert outcome == [5, -1, ""]
    assert "Can't sample trajectory. Controller is not running." in refusal
    assert lines == [
        "ERROR: Can't accept new action goals. Controller is not running.",
        "ERROR: Can't accept new commands. Controller is not running.",
        "ERROR: Can't sample trajectory. Controller is not running.",
    ]


def test_cancelling_holds_the_position(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 1.0))
arm.run(51)
arm.client.cancel_goal()
outcome = arm.outcome()
arm.run(20)
show([outcome, arm.positions()])
""")
    assert shown == [[2, 0, ""], [0.5, -0.5]]


def test_a_new_goal_preempts_and_starts_where_the_old_one_is(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 1.0))
arm.run(51)
other = actionlib.SimpleActionClient("/c/follow_joint_trajectory", FollowJointTrajectoryAction)
assert other.wait_for_server(rospy.Duration(30))
other.send_goal(make_goal(([0.0, 0.0], 0.5)))
outcome = arm.outcome()
wait_until(lambda: other.get_state() == 1)
arm.run(1)
here = arm.positions()
arm.run(60)
assert other.wait_for_result(rospy.Duration(30))
show([outcome, here, arm.positions(), other.get_state()])
""")
    assert shown == [[2, 0, ""], [0.51, -0.51], [0.0, 0.0], 3]


def test_a_goal_that_has_succeeded_but_not_left_is_not_lost(run: Run) -> None:
    """ROS drops the result of a goal that succeeds less than a monitor's period before a new goal comes."""
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 0.05))
arm.run(7)
state = arm.client.get_state()
other = actionlib.SimpleActionClient("/c/follow_joint_trajectory", FollowJointTrajectoryAction)
assert other.wait_for_server(rospy.Duration(30))
other.send_goal(make_goal(([0.0, 0.0], 0.5)))
show([state, arm.outcome()])
""")
    assert shown == [1, [3, 0, ""]]


def test_a_command_cancels_the_goal_and_an_empty_one_holds(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 1.0))
arm.run(51)
command = Publisher("/c/command", JointTrajectory)
command.send(make_trajectory(([0.0, 0.0], 0.5)), lambda: arm.client.get_state() == 2)
outcome = arm.outcome()
arm.run(26)
halfway = arm.positions()
command.send(JointTrajectory(), lambda: arm.controller.follower._requests)
arm.run(50)
show([outcome, halfway, arm.positions()])
""")
    assert shown == [[2, 0, ""], [0.255, -0.255], [0.255, -0.255]]


def test_a_goal_without_points_stops_and_succeeds(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 1.0))
arm.run(51)
arm.send()
arm.run(20)
show([arm.outcome(), arm.positions()])
""")
    assert shown == [[3, 0, ""], [0.5, -0.5]]


def test_stopping_in_mid_motion_cancels_the_goal(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 1.0))
arm.run(51)
arm.controller.stopping(arm.now)
outcome = arm.outcome()
arm.joint("a").position = 0.25
arm.start()
start = arm.positions()
arm.run(20)
show([outcome, start, arm.positions()])
""")
    assert shown == [[2, 0, ""], [0.25, -0.5], [0.25, -0.5]]


def test_tolerances_of_a_goal_abort_it_at_once(run: Run) -> None:
    shown = run("""
arm = Arm({"action_monitor_rate": 0.1})
goal = make_goal(([1.0, -1.0], 1.0))
goal.path_tolerance = [JointTolerance(name="b", position=0.105)]
arm.client.send_goal(goal)
wait_until(lambda: arm.client.get_state() == 1)
arm.cycle(11)
before = arm.client.get_state()
arm.cycle(1)
show([before, arm.outcome()])
""")
    assert shown == [1, [4, -4, "b path error -0.110000"]]


def test_constraints_and_goal_time_of_the_parameters(run: Run) -> None:
    shown = run("""
arm = Arm({"constraints": {"goal_time": 0.1, "a": {"goal": 0.05}}})
arm.send(([1.0, -1.0], 0.1))
arm.cycle(20)
before = arm.client.get_state()
arm.cycle(1)
show([before, arm.outcome()])
""")
    assert shown == [1, [4, -5, "a goal error 1.000000"]]


def test_the_state_is_published_at_its_rate(run: Run) -> None:
    shown = run("""
arm = Arm()
states = Received("/c/state", JointTrajectoryControllerState)
wait_until(lambda: arm.controller._state._publisher.get_num_connections())
arm.send(([1.0, -1.0], 1.0))
arm.joint("a").position, arm.joint("a").velocity = 0.05, 0.5
for count in range(3):
    arm.cycle(11 if count == 0 else 10)
    m = states.wait(count + 1)
def points(*all): return [[[round(value, 6) for value in values]
                           for values in (p.positions, p.velocities, p.accelerations, p.effort)] for p in all]
show([[round(each.header.stamp.to_sec(), 6) for each in states.messages], m.joint_names,
      points(m.desired, m.actual, m.error),
      [round(p.time_from_start.to_sec(), 6) for p in (m.desired, m.actual, m.error)]])
""")
    stamps, names, points, times = shown
    assert stamps == [100.11, 100.21, 100.31]
    assert names == ["a", "b"]
    assert points == [
        [[0.3, -0.3], [1.0, -1.0], [0.0, 0.0], []],
        [[0.05, 0.0], [0.5, 0.0], [], []],
        [[0.25, -0.3], [0.5, -1.0], [], []],
    ]
    assert times == [0.0, 0.3, -0.3]


def test_the_state_is_not_caught_up_after_a_pause(run: Run) -> None:
    shown = run("""
arm = Arm()
states = Received("/c/state", JointTrajectoryControllerState)
wait_until(lambda: arm.controller._state._publisher.get_num_connections())
arm.cycle(1, milliseconds=5000)
states.wait(1)
arm.cycle(11)
states.wait(2)
show([round(each.header.stamp.to_sec(), 6) for each in states.messages])
""")
    assert shown == [105.0, 105.11]


def test_query_state_samples_the_trajectory(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 1.0))
arm.run(51)
query = rospy.ServiceProxy("/c/query_state", QueryTrajectoryState)
answer = query(rospy.Time(100, 760_000_000))
show([answer.name, [round(each, 6) for values in (answer.position, answer.velocity, answer.acceleration) for each in values],
      refusal(lambda: query(rospy.Time(99)))])
""")
    names, values, refusal = shown
    assert names == ["a", "b"]
    assert values == [0.75, -0.75, 1.0, -1.0, 0.0, 0.0]
    assert "Requested sample time precedes trajectory start time." in refusal


def test_points_in_the_past_are_dropped_with_a_warning(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.run(100)
logged = Logged()
arm.send(([5.0, 5.0], 0.0), ([1.0, 1.0], 1.0), stamp=100.5)
arm.run(60)
show([arm.positions(), [line for line in logged.lines if line.startswith("WARN")]])
""")
    assert shown == [
        [1.0, 1.0],
        [
            "WARNING: Dropping first 1 trajectory point(s) out of 2, as they occur before the current time.\n"
            "First valid point will be reached in 0.490s."
        ],
    ]


COMMANDS = {
    "position": [[0.064, 0, 0, 0], [0.064, 0, 0, 0]],
    "pos_vel": [[0.064, 0.48, 0, 0], [0.064, 0.48, 0, 0]],
    "pos_vel_acc": [[0.064, 0.48, 2.4, 0], [0.064, 0.48, 2.4, 0]],
    "velocity": [[0, 2 * 0.064 + 0.48, 0, 0], [0, 3 * 0.064 + 0.1 * 0.48, 0, 0]],
    "effort": [[0, 0, 0, 2 * 0.064 + 0.48], [0, 0, 0, 3 * 0.064 + 0.1 * 0.48]],
}


def test_each_interface_gets_its_commands(run: Run) -> None:
    """Both joints stay at 0; the desired position is the third power of the time."""
    shown = run(f"""
GAINS = {{"gains": {{"a": {{"p": 2}}, "b": {{"p": 3.0, "d": 0.1}}}}, "velocity_ff": {{"a": 1}}}}
goal = make_goal(([1.0, 1.0], 1.0))
goal.trajectory.points[0].velocities = [3.0, 3.0]
goal.trajectory.points[0].accelerations = [6.0, 6.0]
def commands(interface):
    arm = Arm(GAINS, f"{{interface}}_controllers/JointTrajectoryController")
    arm.client.send_goal(goal)
    wait_until(lambda: len(arm.controller.follower._requests) == 1)
    arm.cycle(41)
    arm.controller.close()
    return [[[round(value, 9) for value in (joint.position_command, joint.velocity_command, joint.acceleration_command,
                                            joint.effort_command)] for joint in arm.hardware.joints.values()],
            [list(each.resources) for each in arm.resources.claimed(type(arm.controller).interfaces)]]
show([commands(interface) for interface in {list(COMMANDS)}])
""")
    assert shown == [[commands, [["a", "b"]]] for commands in COMMANDS.values()]


def test_a_closed_loop_needs_gains(run: Run) -> None:
    shown = run("""
def init(kind, parameters): return failure(lambda: Rig(kind, {**USUAL, **parameters}, "a b", URDF))
show([init("effort_controllers/JointTrajectoryController", {}),
      init("velocity_controllers/JointTrajectoryController", {"gains": {"a": {"p": 1}, "b": {"d": 1}}}),
      init("effort_controllers/JointTrajectoryController", {"gains": {"a": {"p": math.inf}}}),
      rospy.get_published_topics("/c")])
""")
    assert shown[:2] == [f"No p gain specified for pid.  Namespace: /c/gains/{joint}" for joint in "ab"]
    assert "must be a finite number" in shown[2]
    assert shown[3] == []  # nothing is left open


def test_gains_are_reconfigured(run: Run) -> None:
    shown = run("""
from dynamic_reconfigure.client import Client
arm = Arm({"gains": {"a": {"p": 2}, "b": {"p": 3.0}}}, "effort_controllers/JointTrajectoryController")
arm.joint("a").position = -0.5
arm.controller.starting(arm.now)
arm.joint("a").position = -1.0
Client("/c/gains/a", timeout=30).update_configuration({"p": 100})
arm.cycle(1)
show(arm.joint("a").effort_command)
""")
    assert shown == pytest.approx(50.0)


def test_wrong_parameters_are_refused(run: Run) -> None:
    shown = run("""
def init(**parameters):
    values = {key: value for key, value in {**USUAL, **parameters}.items() if value is not None}
    return failure(lambda: Rig(KIND, values, "a", URDF))
show([init(joints=None), init(joints=["a", "z"]), init(), init(joints=["a"], state_publish_rate=0),
      init(joints=["a"], action_monitor_rate=-1), init(joints=["a"], stop_trajectory_duration=-0.1),
      init(joints=["a"], stop_trajectory_duration=math.nan),
      failure(lambda: Rig(KIND, USUAL, "a b"))])
""")
    rates = "state_publish_rate and action_monitor_rate must be above 0, stop_trajectory_duration at least 0 (namespace: /c)."
    assert shown == [
        "Could not find 'joints' parameter (namespace: /c).",
        "Could not find joint 'z' in URDF model.",
        "Could not find joint 'b' in 'hardware_interface::PositionJointInterface'.",
        rates,
        rates,
        rates,
        "parameter /c/stop_trajectory_duration is nan: it must be a finite number",
        "Could not find parameter robot_description on parameter server",
    ]


def test_closing_leaves_no_topic_and_ends_the_goal(run: Run) -> None:
    shown = run("""
arm = Arm()
arm.send(([1.0, -1.0], 1.0))
arm.run(3)
arm.controller.close()
outcome = arm.outcome()
topics = [topic for topic, _ in rospy.get_published_topics("/c") if not topic.endswith(("/goal", "/cancel"))]
show([outcome, topics])
""")
    assert shown == [[2, 0, ""], []]


def test_a_position_that_is_not_a_number_is_never_commanded(run: Run) -> None:
    shown = run("""
arm = Arm(start=False)
arm.joint("a").position, arm.joint("a").position_command = math.nan, 0.5
arm.start()
start = arm.positions()
arm.cycle(5)
arm.controller.follower.request_hold()
arm.cycle(5)
show([start, arm.positions()])
""")
    assert shown == [[0.5, 0.0], [0.5, 0.0]]
