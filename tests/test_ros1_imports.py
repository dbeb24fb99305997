"""ros1_imports: rospy and the commands after ROS 2 is sourced, whose packages of the same names come first on PYTHONPATH."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import rospy
from std_msgs.msg import Header, String
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import Log
from actionlib_msgs.msg import GoalID
import genpy, tf2_ros, only_msgs.msg
assert Header is rospy.Header
assert only_msgs.msg.Thing.kind == "ROS 2"
print(String._md5sum, Log._type, tf2_ros.__name__, PoseStamped().header.seq, genpy.Time(1).secs)
"""


@pytest.fixture
def sourced(tmp_path: Path) -> dict[str, str]:
    """Return a terminal's environment after ROS 2 is sourced, with packages as rosidl and ament generate them."""
    prefix = tmp_path / "opt"
    site = prefix / "lib" / "python3" / "site-packages"
    index = prefix / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    for package in ("std_msgs", "geometry_msgs", "rosgraph_msgs", "actionlib_msgs", "only_msgs"):
        (site / package / "msg").mkdir(parents=True)
        (site / package / "__init__.py").touch()
        text = f"from {package}.msg._thing import Thing  # noqa: F401\n"
        (site / package / "msg" / "__init__.py").write_text(text)
        (site / package / "msg" / "_thing.py").write_text("class Thing:\n    kind = 'ROS 2'\n")
    (site / "tf2_ros").mkdir()
    (site / "tf2_ros" / "__init__.py").write_text("import rclpy\n")
    (index / "tf2_ros").touch()
    return {**os.environ, "PYTHONPATH": str(site), "PYTHONDONTWRITEBYTECODE": "1"}


def run(program: str, environ: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program], env=environ, capture_output=True, text=True, timeout=100, check=False
    )


def test_rospy_and_its_messages_can_be_imported_with_ros2_sourced(sourced: dict[str, str]) -> None:
    done = run(PROGRAM, sourced)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "992ce8a1687cec8c8bd883ec73ca41d1 rosgraph_msgs/Log tf2_ros 0 1\n"


def test_folder_without_a_module_hides_no_package(sourced: dict[str, str], tmp_path: Path) -> None:
    source = tmp_path / "source"
    (source / "geometry_msgs").mkdir(parents=True)
    path = os.pathsep.join([sourced["PYTHONPATH"], str(source)])
    done = run(
        "import rospy\nfrom geometry_msgs.msg import Pose\nprint(Pose._type)", {**sourced, "PYTHONPATH": path}
    )
    assert (done.stdout, done.returncode) == ("geometry_msgs/Pose\n", 0), done.stderr


def test_messages_of_ros2_that_came_first_are_named_in_one_line(sourced: dict[str, str]) -> None:
    done = run("from std_msgs.msg import Thing\nimport rospy", sourced)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(
        "ImportError: std_msgs of ROS 2 has been imported already ("
    )
    assert "import rospy before any messages" in done.stderr


def test_a_process_without_rospy_imports_what_is_first(sourced: dict[str, str]) -> None:
    # The ROS 2 bridge uses ROS 2's packages in this way.
    done = run("import minirospy.aio.node\nfrom std_msgs.msg import Thing\nprint(Thing.kind)", sourced)
    assert done.stdout == "ROS 2\n", done.stderr


@pytest.mark.parametrize(
    "program",
    [
        "import minirospy.ros.tf2_ros.tf2_ros, geometry_msgs.msg as m; print(m.Twist._type)",
        "import minirospy.ros.tf2_ros.tools.static_publisher as m; print(m.Header._type)",
    ],
)
def test_minirospy_program_can_be_imported_with_ros2_sourced(sourced: dict[str, str], program: str) -> None:
    done = run(program, sourced)
    assert done.returncode == 0, done.stderr


def test_command_uses_ros1_messages_with_ros2_sourced(sourced: dict[str, str], master: str) -> None:
    words = (sys.executable, "-m", "minirospy", "topic", "pub", "-1", "/x", "std_msgs/String", "hi")
    environ = {**sourced, "ROS_MASTER_URI": master}
    done = subprocess.run(words, env=environ, capture_output=True, text=True, timeout=100, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_program_with_the_name_of_a_package_of_both_imports_that_of_ros1(
    sourced: dict[str, str], tmp_path: Path
) -> None:
    program = tmp_path / "geometry_msgs.py"
    program.write_text("import rospy\nfrom geometry_msgs.msg import Twist\nprint(Twist._type)\n")
    done = subprocess.run(
        [sys.executable, str(program)], env=sourced, capture_output=True, text=True, timeout=100, check=False
    )
    assert (done.stdout, done.returncode) == ("geometry_msgs/Twist\n", 0), done.stderr
