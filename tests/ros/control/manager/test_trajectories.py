"""Arms and grippers with real processes: a loopback, whose manager has the controllers, and actionlib's clients."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.ros.control.manager.conftest import Program, Start, call

ARM = Path(__file__).parents[3] / "core" / "urdf" / "arm.urdf"
LOAD = f"""
rospy.set_param("/robot_description", open({str(ARM)!r}).read())
rospy.set_param("/arm", {{"type": "position_controllers/JointTrajectoryController", "joints": ["shoulder", "elbow"],
                          "constraints": {{"goal_time": 30.0, "shoulder": {{"goal": 0.01}}}}}})
rospy.set_param("/hand", {{"type": "position_controllers/GripperActionController", "joint": "left"}})
"""
START = """
rospy.wait_for_service("/controller_manager/load_controller")
print([cm.load_controller(each) for each in ("arm", "hand")], cm.start_controllers(["arm", "hand"]))
"""
CLIENT = """
import actionlib, sys
from control_msgs.msg import *
from trajectory_msgs.msg import *
rospy.init_node("client", anonymous=True)
arm = actionlib.SimpleActionClient("/arm/follow_joint_trajectory", FollowJointTrajectoryAction)
assert arm.wait_for_server(rospy.Duration(60))
def move(position, seconds):
    point = JointTrajectoryPoint(positions=[position] * 2, velocities=[0] * 2, time_from_start=rospy.Duration(seconds))
    arm.send_goal(FollowJointTrajectoryGoal(trajectory=JointTrajectory(joint_names=["elbow", "shoulder"], points=[point])))
def outcome():
    assert arm.wait_for_result(rospy.Duration(60))
    return [arm.get_state(), arm.get_result().error_code]
def wait_for(reached):
    # wait until the desired position of the shoulder fulfils a condition
    while not reached(rospy.wait_for_message("/arm/state", JointTrajectoryControllerState, 60).desired.positions[0]):
        pass
"""


@pytest.fixture
def loopback(start: Start) -> Program:
    """Start a loopback with both controllers."""
    call(LOAD)
    program = start("minirospy_hardware", "loopback", "_initial:={left: 0.02}")
    assert call(START).endswith("[True, True] True\n")
    return program


@pytest.mark.usefixtures("loopback")
def test_goals_are_reached_survive_a_killed_client_and_end_with_the_controller(start: Start) -> None:
    printed = call(
        CLIENT
        + """
hand = actionlib.SimpleActionClient("/hand/gripper_cmd", GripperCommandAction)
assert hand.wait_for_server(rospy.Duration(60))
move(0.4, 0.3)
hand.send_goal(GripperCommandGoal(GripperCommand(0.04, 2.0)))
print(outcome(), hand.wait_for_result(rospy.Duration(60)), hand.get_state(), hand.get_result().reached_goal)
wait_for(lambda position: position == 0.4)
"""
    )
    assert printed == "[3, 0] True 3 True\n"

    # A killed client does not stop the arm.
    client = start(
        "-c",
        "import rospy\n"
        + CLIENT
        + "move(0.0, 1.5); wait_for(lambda p: p < 0.3); print('half'); rospy.spin()",
    )
    client.read_until("half")
    client.process.kill()
    printed = call(
        CLIENT
        + "wait_for(lambda position: position == 0.0); move(0.2, 0.3); print(outcome(), arm.get_state())"
    )
    assert printed == "[3, 0] 3\n"

    # Stopping the controller cancels the goal.
    printed = call(
        CLIENT
        + """
move(0.4, 30.0)
wait_for(lambda position: position > 0.2)
print(cm.stop_controller("arm"), outcome())
move(0.4, 0.1)
print(outcome())
print(cm.start_controller("arm"))
move(0.4, 0.1)
print(outcome())
print(cm.stop_controller("arm"), cm.unload_controller("arm"), cm.load_controller("arm"), cm.start_controller("arm"))
assert arm.wait_for_server(rospy.Duration(60))
move(0.2, 0.1)
print(outcome())
"""
    )
    lines = [line for line in printed.splitlines() if line.startswith(("True", "["))]
    assert lines == [
        "True [2, 0]",
        "[5, -1]",
        "True",
        "[3, 0]",
        "True True True True",
        "[3, 0]",
    ]


@pytest.mark.skipif(sys.platform == "win32", reason="a registration of a killed node is taken over")
def test_a_killed_controller_starts_again(loopback: Program, start: Start) -> None:
    call(CLIENT + "move(0.4, 30.0); wait_for(lambda position: position > 0.0)")
    loopback.process.kill()
    loopback.process.wait()
    start("minirospy_hardware", "loopback")
    assert call(START).endswith("[True, True] True\n")
    assert call(CLIENT + "move(0.2, 0.2); print(outcome())") == "[3, 0]\n"
