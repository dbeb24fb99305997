"""roslaunch-deps, roslaunch-logs, and the args that `roslaunch --ros-args` lists."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from minirospy.ros.roslaunch.commands import roslaunch, roslaunch_deps, roslaunch_logs
from minirospy.runtime.rpc.master_proxy import MasterProxy


@pytest.fixture
def files(package: Path) -> Path:
    """Return a launch file that includes a file from another package, and runs nodes from two packages."""
    other = package.parent / "other"
    other.mkdir()
    (other / "package.xml").write_text("<package><name>other</name><run_depend>pkg</run_depend></package>")
    (other / "b.launch").write_text('<launch><node name="b" pkg="pkg" type="wait.py"/></launch>')
    file = package / "a.launch"
    file.write_text(
        '<launch><arg name="need"/><include file="$(find other)/b.launch"/><rosparam file="/no/such.yaml"/>'
        '<node name="a" pkg="third" type="t" args="$(arg need)"/><node name="c" pkg="pkg" type="wait.py"/>'
        '<include file="$(find other)/c.launch" if="false"/></launch>'
    )
    return file


def test_what_a_file_needs(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    inner = files.parents[1] / "other" / "b.launch"
    inner_line = f"pkg [pkg/wait.py]\nother [{inner}]\n"
    assert roslaunch_deps.main([str(inner)]) == 0
    assert capsys.readouterr().out == "pkg\n"
    # Files that do not exist yet and an arg without a value are not errors.
    assert roslaunch_deps.main(["-v", "-w", str(files)]) == 0
    said = capsys.readouterr().out
    assert said == (
        f"Dependencies:\nthird [third/t]\npkg [pkg/wait.py]\npkg [{files}]\n{inner_line}{'-' * 80}\nother third\n\n"
        "Missing declarations:\npkg/package.xml:\n"
        "  <exec_depend>other</exec_depend>\n  <exec_depend>third</exec_depend>\n"
    )


def test_a_missing_file_is_reported(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files.write_text('<launch>\n<include file="$(find other)/gone.launch"/></launch>')
    assert roslaunch_deps.main([str(files)]) == 0
    said = capsys.readouterr()
    gone = files.parents[1] / "other" / "gone.launch"
    assert said.out == "other\n"
    assert said.err == f"WARNING: {files}:2: cannot include [{gone}]: No such file or directory\n"


def test_what_is_no_launch_file(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch_deps.main([str(files.parent / "package.xml")]) == 1
    assert "no root <launch> tag, but <package>" in capsys.readouterr().err
    assert roslaunch_deps.main(["/no/such.launch"]) == 2
    assert "cannot locate /no/such.launch" in capsys.readouterr().err


def test_location_of_log_files(master: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    proxy = MasterProxy(master, "/t")
    proxy.set_param("/run_id", "a-run")
    proxy.close()
    folder = Path(os.environ["ROS_HOME"]) / "log"
    assert roslaunch_logs.main([]) == 0
    assert capsys.readouterr().out == f"{folder}/a-run\n"


@pytest.mark.parametrize(
    "run_id", ["../../elsewhere", "/etc", ".ssh", "a\n", "\x9b2J", ["a"], 5, "", "x" * 200]
)
def test_run_id_that_leads_elsewhere_is_not_followed(
    run_id: object, master: str, capsys: pytest.CaptureFixture[str]
) -> None:
    proxy = MasterProxy(master, "/t")
    proxy.set_param("/run_id", run_id)
    proxy.close()
    # A list's text does not look like a path, so it is also rejected.
    assert roslaunch_logs.main([]) == (0 if run_id == 5 else 1)
    assert "elsewhere" not in capsys.readouterr().out


def test_without_a_master(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    assert roslaunch_logs.main([]) == 2
    said = capsys.readouterr()
    assert (Path(said.out.strip()).name, said.err) == ("log", "No active roscore\n")


def test_the_args_of_a_file_as_they_are(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Defaults are resolved, and only args that apply are listed; a value that cannot be resolved stays as written."""
    file = package / "a.launch"
    file.write_text(
        '<launch><arg name="need" doc="a thing"/><arg name="a" default="1"/><arg name="b" default="$(arg a)2"/>'
        '<arg name="c" default="x" if="$(arg a)"/><arg name="c" default="y" unless="$(arg a)"/>'
        '<arg name="d" default="$(arg need)!"/><arg name="v" value="3"/><arg name="e" default="$(eval v + 1)"/></launch>'
    )
    text = (
        'Required Arguments:\n  need: a thing\nOptional Arguments:\n  a (default "1"): undocumented\n'
        '  b (default "{}2"): undocumented\n  c (default "{}"): undocumented\n  d (default "{}!"): undocumented\n'
        '  e (default "4"): undocumented\n'
    )
    assert roslaunch.main(["--ros-args", str(file)]) == 0
    assert capsys.readouterr().out == text.format("1", "x", "$(arg need)")
    assert roslaunch.main(["--ros-args", str(file), "a:=0", "need:=n"]) == 0
    assert capsys.readouterr().out == text.format("0", "y", "n")
