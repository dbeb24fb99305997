"""workspace/elsewhere: the table of compiled packages, and where its texts are printed."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.base.errors import NotFoundError
from minirospy.cli.windows import WINDOWS
from minirospy.workspace import elsewhere
from minirospy.workspace.elsewhere import IMPORTED, SUBMODULES, advice
from minirospy.workspace.packages import Packages, built_in_roots

OVERLAY = Path(elsewhere.__file__).parents[1] / "overlay"
TABLE = sorted(
    {
        *elsewhere.CPP,
        *elsewhere.INSTEAD,
        *elsewhere.QT_PLUGINS,
        *elsewhere.QT_LIBRARIES,
    }
)


@pytest.mark.parametrize("name", [*TABLE, *elsewhere.MESSAGES])
def test_advice_is_one_line_that_names_what_to_type(name: str) -> None:
    text = advice(name)
    assert "\n" not in text
    assert "{" not in text
    assert re.search(r"`[a-z]\S* ", text)


def test_plug_ins_with_a_view_have_programs() -> None:
    plug_ins = {each.package or each.command for each in WINDOWS}
    assert plug_ins <= set(Packages.below(*built_in_roots()).names())
    assert plug_ins & {*elsewhere.QT_PLUGINS, *elsewhere.QT_LIBRARIES} <= {"rqt_gui"}


def test_unknown_names_have_no_advice() -> None:
    assert advice("no_such_package") == ""
    assert advice("") == ""


def test_packages_of_the_table_are_not_included() -> None:
    # minirospy provides programs of rqt_gui and rviz, but their Python modules belong to Qt windows.
    assert set(TABLE) & set(Packages.below(*built_in_roots()).names()) == {"rqt_gui", "rviz"}


def test_each_imported_module_of_the_table_is_in_the_overlay() -> None:
    refusing = {
        path.parent.name
        for path in OVERLAY.glob("*/__init__.py")
        if "minirospy.ros.elsewhere" in path.read_text(encoding="utf-8")
    }
    assert refusing == IMPORTED


@pytest.mark.parametrize("name", sorted(IMPORTED))
def test_imports_raise_import_error_in_one_line(name: str) -> None:
    with pytest.raises(ImportError) as caught:
        importlib.import_module(name)
    assert caught.value.name == name
    assert str(caught.value) == f"No module named '{name}': {advice(name)}"


@pytest.mark.parametrize("name", sorted(SUBMODULES))
def test_submodules_that_are_missing_name_what_to_use(name: str) -> None:
    with pytest.raises(ImportError, match="minirospy does not have the module") as caught:
        importlib.import_module(name)
    assert str(caught.value).endswith(SUBMODULES[name])


def test_package_that_a_workspace_has_comes_first(tmp_path: Path) -> None:
    folder = tmp_path / "amcl"
    folder.mkdir()
    with pytest.raises(NotFoundError, match="RoboStack"):
        Packages.below(tmp_path).find("amcl")
    (folder / "package.xml").write_text("<package><name>amcl</name></package>")
    assert Packages.below(tmp_path).find("amcl") == folder


def test_module_that_is_installed_comes_first(tmp_path: Path) -> None:
    (tmp_path / "moveit_commander").mkdir()
    (tmp_path / "moveit_commander" / "__init__.py").write_text("REAL = True\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import moveit_commander; print(moveit_commander.REAL)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout == "True\n", done.stderr


def test_rosrun_prints_the_line_of_ros_and_then_the_advice() -> None:
    command = [
        sys.executable,
        "-m",
        "minirospy.ros.rosbash.commands.rosrun",
        "amcl",
        "amcl",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    first, second = done.stderr.splitlines()
    assert first == "[rospack] Error: package 'amcl' not found"
    assert second == f"rosrun: ERROR: package [amcl] not found: {advice('amcl')}"
    assert "localization" in second
