"""Joints set with keys, and joint_state_publisher_gui in a terminal and without one."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.ros.robot_state_publisher.joints import FreeJoint
from minirospy.ros.robot_state_publisher.sliders import Sliders
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.workspace.packages import Packages
from tests.ros.robot_state_publisher.conftest import ARM, SECONDS, Start, python

NAME = "joint_state_publisher_gui"
FIRST_POSITION = """
import rospy
from sensor_msgs.msg import JointState
rospy.init_node("reader", disable_rosout=True)
while True:
    message = rospy.wait_for_message("joint_states", JointState)
    if {condition}:
        break
print(round(message.position[0], 4))
"""


def joints() -> dict[str, FreeJoint]:
    return {"a": FreeJoint(-1, 1, 0, 0.0), "b": FreeJoint(0, 10, 5, None), "c": FreeJoint(0, 0, 0, 0.0)}


def test_keys_select_and_set() -> None:
    free = joints()
    sliders = Sliders(free)
    assert sliders.press("right")
    assert not sliders.press("down")
    assert [sliders.press(key) for key in ("<", "left", "x", "")] == [True, True, False, False]
    assert (free["a"].position, free["b"].position) == pytest.approx((0.02, 3.9))
    sliders.press("0")
    assert free["b"].position == 5
    for _ in range(200):
        sliders.press(">")
    assert free["b"].position == 10


def test_all_joints_are_centred_and_randomized() -> None:
    free = joints()
    sliders = Sliders(free, random.Random(1))
    sliders.press("r")
    assert all(joint.lower <= (joint.position or 0) <= joint.upper for joint in free.values())
    assert free["a"].position != 0
    sliders.press("c")
    assert [joint.position for joint in free.values()] == [0, 5, 0]


def test_rows_are_those_around_the_selected_one() -> None:
    free = {f"j{number}": FreeJoint(-1, 1, 0, 0.0) for number in range(10)}
    sliders = Sliders(free)
    assert [row.name for row in sliders.rows(3)] == ["j0", "j1", "j2"]
    for _ in range(5):
        sliders.press("down")
    assert [row.name for row in sliders.rows(3) if row.is_selected] == ["j5"]
    sliders.press("up")
    for _ in range(5):
        sliders.press("down")
    assert [row.name for row in sliders.rows(3)] == ["j7", "j8", "j9"]
    row = sliders.rows(3, width=5)[-1]
    assert (row.bar, row.text) == ("--|--", "   0.000  (-1 .. 1)")


def test_robot_without_joints_has_no_sliders() -> None:
    sliders = Sliders({})
    assert not sliders.press("r")
    assert sliders.rows(5) == []


@pytest.fixture
def arm(master: str) -> None:
    proxy = MasterProxy(master, "/test")
    proxy.set_param("/robot_description", ARM.read_text(encoding="utf-8"))
    proxy.close()


@pytest.mark.usefixtures("arm")
def test_without_a_terminal_it_publishes_zeros(start: Start) -> None:
    start(NAME, NAME)
    assert python(FIRST_POSITION.format(condition="True")) == "0.0\n"


@pytest.mark.skipif(sys.platform == "win32", reason="a terminal of Unix")
@pytest.mark.usefixtures("arm")
def test_keys_in_a_terminal_move_the_robot() -> None:
    import pty

    ours, theirs = pty.openpty()
    command = Packages().find_executable(NAME, NAME)
    program = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=subprocess.PIPE, text=True)
    os.close(theirs)
    seen = b""
    while b"shoulder" not in seen:
        seen += os.read(ours, 4096)
    os.write(ours, b"\x1b[C\x1b[C")
    # Two steps, each 1 % of 3.14 rad.
    assert python(FIRST_POSITION.format(condition="message.position[0] > 0.05")) == "0.0628\n"
    os.write(ours, b"q")
    try:
        while os.read(ours, 4096):
            pass
    except OSError:
        # On Linux, reading fails when the terminal is closed.
        pass
    _, errors = program.communicate(timeout=SECONDS)
    os.close(ours)
    assert (program.returncode, errors) == (0, "")


def test_package_names_its_program() -> None:
    assert Path(Packages().find_executable(NAME, NAME)[-1]).parent.name == "nodes"
