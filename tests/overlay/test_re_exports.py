"""The overlay's hand-written modules only re-export: a docstring, imports with explicit names, `__all__`."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

OVERLAY = Path(__file__).parents[2] / "minirospy" / "overlay"
ROS = OVERLAY.with_name("ros")
SHARED = {
    "camera_calibration_parsers/convert.py",
    "camera_calibration_parsers/texts.py",
    "image_geometry/rectification.py",
    "dynamic_reconfigure/dynparam.py",
    "dynamic_reconfigure/generated.py",
    "dynamic_reconfigure/header.py",
    "message_filters/stamps.py",
    "topic_tools/expressions.py",
    "rosbag/exceptions.py",
    "rosbag/internals.py",
    "rosbag/opening.py",
    "rosbag/private.py",
    "rosbag/readers.py",
    "rospy/live.py",
    "rospy/passing.py",
    "bondpy/machine.py",
    "rosauth/authentication.py",
    "smach_ros/callbacks.py",
    "smach_ros/pickled.py",
    "sound_play/node.py",
    "sound_play/players.py",
    "sound_play/programs.py",
    "sound_play/tones.py",
    "rostopic/echo.py",
    "rostopic/rates.py",
    "kdl_parser_py/tree.py",
    "urdf_parser_py/joints.py",
    "urdf_parser_py/links.py",
    "PyKDL/frames.py",
    "PyKDL/functions.py",
    "PyKDL/vectors.py",
    "tf/composed.py",
    "tf/euler.py",
    "tf/matrices.py",
    "tf/vectors.py",
}
"""Modules of the Python packages in ros/ that are not the counterpart of one module."""
BEHIND = {"actionlib", "tf2_ros", "turtlesim", "joy"}
"""Modules whose names gather what several of ours define."""
HAND_WRITTEN = sorted(
    path for path in OVERLAY.rglob("*.py") if not {"msg", "srv"} & set(path.relative_to(OVERLAY).parts)
)


def is_docstring(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def is_import(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.ImportFrom):
        return all(alias.name != "*" for alias in statement.names)
    return isinstance(statement, ast.Import)


def is_list_of_names(statement: ast.stmt) -> bool:
    if not (isinstance(statement, ast.Assign) and isinstance(statement.value, ast.List)):
        return False
    return [ast.unparse(target) for target in statement.targets] == ["__all__"]


@pytest.mark.parametrize("path", HAND_WRITTEN, ids=lambda path: str(path.relative_to(OVERLAY)))
def test_an_overlay_module_only_re_exports(path: Path) -> None:
    first, *rest = ast.parse(path.read_text(encoding="utf-8")).body
    assert is_docstring(first)
    assert [ast.unparse(each) for each in rest if not (is_import(each) or is_list_of_names(each))] == []


def test_there_are_hand_written_modules() -> None:
    assert len(HAND_WRITTEN) > 100


def test_module_of_a_ros_package_has_the_name_of_the_module_that_it_emulates() -> None:
    """So that what `import rosgraph.masterapi` offers is found in ros/rosgraph/rosgraph/masterapi.py."""
    emulated = {path.relative_to(OVERLAY) for path in HAND_WRITTEN}
    modules = {path.parts[0].removesuffix(".py") for path in emulated} - BEHIND
    ours = {
        path.relative_to(package)
        for package in ROS.iterdir()
        for path in package.rglob("*.py")
        if path.relative_to(package).parts[0].removesuffix(".py") in modules
    }
    assert len(ours) > 150
    assert {path.as_posix() for path in ours - emulated} == SHARED
