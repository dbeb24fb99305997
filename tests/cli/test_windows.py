"""cli/windows: rqt's windows, as plugins and as ROS packages."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.base.errors import UsageError
from minirospy.cli.windows import WINDOWS, view_of_plugin, write_packages
from minirospy.web.dashboard.views import VIEWS
from minirospy.workspace.packages import Packages


def test_plug_in_without_a_view_is_refused_with_those_that_have_one() -> None:
    assert view_of_plugin("topics") == "topics"
    assert view_of_plugin("rqt_topic") == view_of_plugin("rqt_topic.topic.Topic") == "topics"
    assert view_of_plugin("rqt_top") == view_of_plugin("rqt_top/Top") == "nodes"
    assert view_of_plugin("rqt_robot_steering") == "teleop"
    assert view_of_plugin("rqt_robot_monitor") == view_of_plugin("rqt_runtime_monitor") == "diagnostics"
    with pytest.raises(
        UsageError, match=r"there is no view for the plug-in 'rqt_moveit': there are .*rqt_topic"
    ):
        view_of_plugin("rqt_moveit")


def test_every_window_has_a_view_of_the_page() -> None:
    assert {each.view for each in WINDOWS} <= set(VIEWS)


def test_package_of_a_window_has_a_program_that_rosrun_finds(tmp_path: Path) -> None:
    names = write_packages(tmp_path)
    packages = Packages.below(tmp_path)
    assert packages.names() == sorted(names)
    assert packages.find_executable("rqt_gui", "rqt_gui")[-1] == str(
        tmp_path / "rqt_gui" / "scripts" / "rqt_gui"
    )
    assert packages.executables("smach_viewer") == ["smach_viewer", "smach_viewer.py"]
