"""ROS's packages that minirospy provides: rospack and rospkg find them and their dependencies."""

from __future__ import annotations

from pathlib import Path

import pytest
import rospkg

from minirospy.ros.rospack.commands.rospack import main as rospack
from minirospy.workspace.manifest import read_manifest
from minirospy.workspace.packages import Packages

ROOT = Path(__file__).parents[2] / "minirospy"
FOLDERS = sorted(path.parent for path in (ROOT / "ros").glob("*/package.xml"))
# Python packages that are not ROS packages. camera_info_manager is a module in the package camera_info_manager_py.
assert len(FOLDERS) > 50
NO_PACKAGES = {"PyKDL", "RPi", "ament_index_python", "camera_info_manager", "catkin_pkg", "rospkg"}


def test_each_is_in_order() -> None:
    for folder in FOLDERS:
        manifest = read_manifest(folder)
        assert manifest.name == folder.name
        assert manifest.problems == (), folder.name


def test_importable_packages_are_found() -> None:
    known = set(rospkg.RosPack().list())
    overlay = {
        path.parent.name
        for path in (ROOT / "overlay").glob("*/__init__.py")
        # Importing these raises an error that names the solution.
        if "minirospy.ros.elsewhere" not in path.read_text(encoding="utf-8")
    }
    assert overlay - NO_PACKAGES <= known


def test_rospack(capsys: pytest.CaptureFixture[str]) -> None:
    assert rospack(["find", "rospy"]) == 0
    assert capsys.readouterr().out == f"{ROOT / 'ros' / 'rospy'}\n"
    assert rospack(["depends1", "rospy"]) == 0
    assert capsys.readouterr().out.split() == [
        "genpy",
        "roscpp",
        "rosgraph",
        "rosgraph_msgs",
        "roslib",
        "std_msgs",
    ]
    assert rospack(["depends1", "actionlib"]) == 0
    assert capsys.readouterr().out.split() == [
        *("message_runtime", "actionlib_msgs", "roscpp", "rospy", "rostest", "std_msgs")
    ]
    assert rospack(["depends-on1", "rostest"]) == 0
    assert capsys.readouterr().out.split() == ["actionlib"]
    assert rospack(["list-names"]) == 0
    # As in ROS, rospack does not list metapackages, such as ros_control.
    packages = {
        folder.name
        for folder in FOLDERS
        if "<metapackage/>" not in (folder / "package.xml").read_text("utf-8")
    }
    assert packages <= set(capsys.readouterr().out.split())


def test_rospkg() -> None:
    packages = rospkg.RosPack()
    assert packages.get_path("rosgraph") == str(ROOT / "ros" / "rosgraph")
    assert "rospy" in packages.get_depends("rostest")
    assert packages.get_manifest("rosmaster").name == "rosmaster"


def test_modules_of_a_package_are_not_its_programs() -> None:
    """`rosrun rosserial_python serial_node.py` runs the program, not the module of that name."""
    packages = Packages.below(ROOT / "ros")
    for folder in FOLDERS:
        for name in packages.executables(folder.name):
            found = packages.find_executables(folder.name, name)
            assert len(found) == 1, (folder.name, name)
            assert Path(found[0][-1]).read_text(encoding="utf-8").startswith("#!"), (folder.name, name)
