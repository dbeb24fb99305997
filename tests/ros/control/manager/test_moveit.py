"""The messages and calls of MoveIt's controller managers (make_recorded_moveit.py), sent by other clients to the loopback."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.ros.control.manager.conftest import Start, call
from tests.ros.control.manager.make_recorded_moveit import INITIAL, SETUP, START

RECORDED = Path(__file__).parent / "recorded_moveit.json"

REPLAY = f"""
import json, threading
from actionlib import ActionClient, CommState
from actionlib_msgs.msg import GoalID
from control_msgs.msg import *
from rospy_message_converter.message_converter import convert_dictionary_to_ros_message as convert

rospy.init_node("move_group")
RECORDED = json.load(open({str(RECORDED)!r}))["messages"]
KINDS = {{"/arm/follow_joint_trajectory": "FollowJointTrajectory", "/hand/gripper_cmd": "GripperCommand"}}

class Raw:
    # The topics of one action, without actionlib.
    def __init__(self, name, kind):
        self.kind, self.goals, self.results = kind, 0, {{}}
        self.changed, self.moving = threading.Condition(), set()
        self.goal = rospy.Publisher(name + "/goal", globals()[kind + "ActionGoal"], queue_size=10)
        self.cancelled = rospy.Publisher(name + "/cancel", GoalID, queue_size=10)
        self.subscribers = [rospy.Subscriber(name + "/result", globals()[kind + "ActionResult"], self.on_result),
                            rospy.Subscriber(name + "/feedback", globals()[kind + "ActionFeedback"], self.on_feedback)]
        while not all(each.get_num_connections() for each in (self.goal, self.cancelled, *self.subscribers)):
            threading.Event().wait(0.01)
    def on_result(self, message):
        with self.changed:
            self.results[message.status.goal_id.id] = message.status.status, message.result
            self.changed.notify_all()
    def on_feedback(self, message):
        with self.changed:
            self.moving.add(message.status.goal_id.id)
            self.changed.notify_all()
    def send(self, values):
        message = convert("control_msgs/" + self.kind + "ActionGoal", values)
        self.goals += 1
        now = rospy.Time.now()
        message.header.stamp = message.goal_id.stamp = now
        message.goal_id.id = f"/move_group-{{self.goals}}-{{now.secs}}.{{now.nsecs}}"
        self.goal.publish(message)
        return message.goal_id.id
    def cancel(self, goal):
        self.cancelled.publish(GoalID(rospy.Time(), goal))
    def wait_until_moving(self, goal):
        with self.changed:
            assert self.changed.wait_for(lambda: goal in self.moving, 60)
    def result(self, goal):
        with self.changed:
            assert self.changed.wait_for(lambda: goal in self.results, 60)
            return self.results[goal]

class Library(Raw):
    # The same by actionlib.
    def __init__(self, name, kind):
        self.kind, self.changed, self.moving = kind, threading.Condition(), set()
        self.client = ActionClient(name, globals()[kind + "Action"])
        assert self.client.wait_for_server(rospy.Duration(60))
    def on_transition(self, handle):
        with self.changed:
            self.changed.notify_all()
    def on_feedback(self, handle, feedback):
        with self.changed:
            self.moving.add(handle)
            self.changed.notify_all()
    def send(self, values):
        goal = convert("control_msgs/" + self.kind + "ActionGoal", values).goal
        return self.client.send_goal(goal, self.on_transition, self.on_feedback)
    def cancel(self, goal):
        goal.cancel()
    def result(self, goal):
        with self.changed:
            assert self.changed.wait_for(lambda: goal.get_comm_state() == CommState.DONE, 60)
        return goal.get_goal_status(), goal.get_result()

def replay(kind):
    clients = {{name: kind(name, action) for name, action in KINDS.items()}}
    ids, outcomes, last = {{}}, [], None
    for name, topic, values in RECORDED:
        client = clients[name]
        if topic == "goal":
            if last:  # a goal that replaces another one
                client.wait_until_moving(last)
            last = ids[values["goal_id"]["id"]] = client.send(values)
        elif topic == "cancel":
            client.wait_until_moving(ids[values["id"]])
            client.cancel(ids[values["id"]])
            last = None
        else:
            status, result = client.result(ids[values["status"]["goal_id"]["id"]])
            shown = (result.error_code, result.error_string) if "arm" in name else (result.stalled, result.reached_goal)
            outcomes.append([name, status, *shown])
            last = None
    return outcomes

for kind in (Raw, Library):
    print(json.dumps(replay(kind)))
"""

CLOCK = """
import itertools, threading
import rospy
from control_msgs.msg import JointTrajectoryControllerState as State
from rosgraph_msgs.msg import Clock

rospy.init_node("clock", disable_signals=True)
publisher = rospy.Publisher("/clock", Clock, queue_size=10)
STEP, LEAD = 10_000_000, 60_000_000  # ns; the controllers publish their states every 20 ms
seen, changed = [], threading.Condition()
def on_state(message):
    with changed:
        if not seen:
            print("follows the loop", flush=True)
        seen.append(message.header.stamp.to_nsec())
        changed.notify_all()
subscribers = [rospy.Subscriber(f"/{name}/state", State, on_state) for name in ("arm", "other_arm")]
for now in itertools.count(1_000_000_000, STEP):
    publisher.publish(Clock(rospy.Time(*divmod(now, 1_000_000_000))))
    with changed:
        changed.wait_for(lambda: not seen or now < seen[-1] + LEAD)
    threading.Event().wait(0.005)
"""

QUERIES = """
from controller_manager_msgs.srv import *
def ask(name, kind, *arguments):
    return rospy.ServiceProxy("/controller_manager/" + name, kind)(*arguments)
print([each for each in rospy.get_published_topics() if each[0].endswith("follow_joint_trajectory/result")])
for each in ask("list_controllers", ListControllers).controller:
    print(each.name, each.state, each.type, [(claim.hardware_interface, claim.resources) for claim in each.claimed_resources])
for start, stop in ((["other_arm"], ["arm", "arm"]), (["other_arm"], ["other_arm"]), (["arm"], ["other_arm"])):
    print(ask("switch_controller", SwitchController, start, stop, 2, False, 0.0).ok)
"""


def outcomes() -> list[list[object]]:
    """Return the recorded results, without measured values."""
    shown: list[list[object]] = []
    for name, topic, values in json.loads(RECORDED.read_text(encoding="utf-8"))["messages"]:
        if topic == "result":
            keys = ("error_code", "error_string") if "arm" in name else ("stalled", "reached_goal")
            shown.append([name, values["status"]["status"], *(values["result"][key] for key in keys)])
    return shown


@pytest.fixture
def loopback(start: Start) -> None:
    """Start a loopback with the recorded robot's controllers, and a clock that waits for the loop.

    With a clock that does not wait, a loop that stalls would exceed a goal's time tolerance, and report another error.
    """
    call(SETUP + "rospy.set_param('/use_sim_time', True)")
    start("minirospy_hardware", "loopback", INITIAL)
    clock = start("-c", CLOCK)
    assert call(START).endswith("[True, True, True] True\n")
    clock.read_until("follows the loop")


@pytest.mark.usefixtures("loopback")
def test_the_messages_and_calls_of_moveit_have_the_recorded_effects() -> None:
    raw, library, topics, *lines = call(REPLAY + QUERIES).splitlines()
    assert json.loads(raw) == outcomes()
    assert json.loads(library) == outcomes()

    kind = "control_msgs/FollowJointTrajectoryActionResult"
    assert topics == str([[f"/{name}/follow_joint_trajectory/result", kind] for name in ("arm", "other_arm")])
    claims = [("hardware_interface::PositionJointInterface", ["elbow", "shoulder"])]
    hand = [("hardware_interface::PositionJointInterface", ["left"])]
    assert lines == [
        f"arm running position_controllers/JointTrajectoryController {claims}",
        f"hand running position_controllers/GripperActionController {hand}",
        f"other_arm initialized position_controllers/JointTrajectoryController {claims}",
        "True",
        "False",
        "True",
    ]
