"""GripperActionController with actionlib's clients; the program holds the time."""

from __future__ import annotations

import pytest

from tests.ros.control.conftest import Run

BEGIN = """
import actionlib, math
from control_msgs.msg import GripperCommand, GripperCommandAction, GripperCommandGoal
URDF = (
    "<robot name='r'><link name='0'/><link name='1'/>"
    "<joint name='a' type='prismatic'><parent link='0'/><child link='1'/>"
    "<limit lower='0' upper='1' effort='1' velocity='1'/></joint></robot>"
)
POSITION, EFFORT = (f"{kind}_controllers/GripperActionController" for kind in ("position", "effort"))
class Hand(Rig):
    def __init__(self, parameters={}, kind=POSITION, start=True):
        super().__init__(kind, {"joint": "a", "action_monitor_rate": 10, **parameters}, "a", URDF)
        self.client = actionlib.SimpleActionClient("/c/gripper_cmd", GripperCommandAction)
        assert self.client.wait_for_server(rospy.Duration(30))
        self.a = self.joint("a")
        if start:
            self.start()
    def send(self, position, effort=0.0):
        self.client.send_goal(GripperCommandGoal(GripperCommand(position, effort)))
        wait_until(lambda: self.client.get_state() != 0)
    def outcome(self):
        assert self.client.wait_for_result(rospy.Duration(30))
        result = self.client.get_result()
        return [self.client.get_state(), result.position, result.effort, result.stalled, result.reached_goal]
"""


@pytest.fixture
def run(run: Run) -> Run:
    """Return a function that runs a program with the tools of this module."""
    return lambda body: run(BEGIN + body)


def test_a_goal_is_reached(run: Run) -> None:
    shown = run("""
hand = Hand()
hand.a.position = 0.25
hand.controller.starting(hand.now)
hand.cycle(1)
start = hand.a.position_command
hand.send(0.5, 3.0)
hand.cycle(3)
command, hand.a.position = hand.a.position_command, 0.495
hand.cycle(7)
before = hand.client.get_state()
hand.cycle(1)
show([start, command, before, hand.outcome(), hand.a.position_command])
""")
    assert shown == [0.25, 0.5, 1, [3, 0.495, 3.0, False, True], 0.5]


def test_a_stalled_goal_is_aborted(run: Run) -> None:
    shown = run("""
hand = Hand({"stall_timeout": 0.2})
hand.send(0.5, 3.0)
hand.cycle(21)
before = hand.client.get_state()
hand.cycle(1)
show([before, hand.outcome()])
""")
    assert shown == [1, [4, 0.0, 3.0, True, False]]


def test_cancelling_and_stopping_hold(run: Run) -> None:
    shown = run("""
hand = Hand()
hand.send(0.5)
hand.cycle(1)
hand.a.position = 0.125
hand.client.cancel_goal()
cancelled = hand.outcome()
hand.cycle(1)
held = hand.a.position_command
hand.send(0.75)
hand.cycle(1)
hand.controller.stopping(hand.now)
stopped = hand.outcome()
hand.send(0.75)
show([cancelled, held, stopped, hand.outcome()])
""")
    empty = [0.0, 0.0, False, False]
    assert shown == [[2, *empty], 0.125, [2, *empty], [5, *empty]]


def test_a_new_goal_preempts(run: Run) -> None:
    shown = run("""
hand = Hand()
hand.send(0.5)
other = actionlib.SimpleActionClient("/c/gripper_cmd", GripperCommandAction)
assert other.wait_for_server(rospy.Duration(30))
other.send_goal(GripperCommandGoal(GripperCommand(0.75, 0)))
outcome = hand.outcome()
wait_until(lambda: other.get_state() == 1)
hand.cycle(1)
show([outcome[0], hand.a.position_command])
""")
    assert shown == [2, 0.75]


def test_goals_that_are_not_numbers_are_rejected(run: Run) -> None:
    shown = run("""
hand = Hand()
hand.send(0.5)
hand.cycle(1)
logged = Logged()
other = actionlib.SimpleActionClient("/c/gripper_cmd", GripperCommandAction)
assert other.wait_for_server(rospy.Duration(30))
outcomes = []
for values in ((math.nan, 0), (0.1, math.inf)):
    other.send_goal(GripperCommandGoal(GripperCommand(*values)))
    assert other.wait_for_result(rospy.Duration(30))
    outcomes.append([other.get_state(), other.get_goal_status_text()])
hand.cycle(1)
show([outcomes, hand.client.get_state(), hand.a.position_command, logged.lines])
""")
    texts = [
        "The goal's position is nan, its max_effort 0.0; both must be finite numbers.",
        "The goal's position is 0.1, its max_effort inf; both must be finite numbers.",
    ]
    assert shown == [[[5, text] for text in texts], 1, 0.5, [f"ERROR: {text}" for text in texts]]


def test_the_effort_is_limited_by_the_goal(run: Run) -> None:
    shown = run("""
gains = {"gains": {"a": {"p": 100, "d": 10}}, "max_effort": 5, "goal_tolerance": 0.1}
hand = Hand(gains, EFFORT)
hand.a.position, hand.a.velocity = -0.03, 0.1
hand.cycle(1)
efforts = [hand.a.effort_command]
hand.a.position = -1.0
hand.cycle(1)
efforts.append(hand.a.effort_command)
for effort in (20.0, -30.0, 0.0):
    hand.send(0.5, effort)
    hand.cycle(1)
    efforts.append(hand.a.effort_command)
    hand.client.cancel_goal()
    hand.outcome()
hand.send(0.5, 20.0)
hand.cycle(2)
hand.a.position = 0.45
hand.cycle(12)
show([[round(effort, 9) for effort in efforts], hand.outcome()])
""")
    assert shown == [[2.0, 5.0, 20.0, 30.0, 0.0], [3, 0.45, 20.0, False, True]]


def test_wrong_parameters_are_refused(run: Run) -> None:
    shown = run("""
def init(kind, parameters, joints="a"):
    return failure(lambda: Rig(kind, {"joint": "a", **parameters}, joints, URDF))
show([init(POSITION, {"joint": ""}), init(POSITION, {"joint": 3}), init(POSITION, {"joint": "z"}),
      init(POSITION, {}, "b"), init(POSITION, {"action_monitor_rate": 0}), init(EFFORT, {}),
      init(POSITION, {"stall_timeout": math.nan}), rospy.get_published_topics("/c")])
""")
    assert shown == [
        "Could not find joint name on param server",
        "Could not find joint name on param server",
        "Could not find joint 'z' in URDF model.",
        "Could not find joint 'a' in 'hardware_interface::PositionJointInterface'.",
        "action_monitor_rate must be above 0 (namespace: /c).",
        "No p gain specified for pid.  Namespace: /c/gains/a",
        "parameter /c/stall_timeout is nan: it must be a finite number",
        [],
    ]
