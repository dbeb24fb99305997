"""`minirospy check --snapshot`: what a student sends for help, and what stays private."""

from __future__ import annotations

import json
import os
import zipfile
from pathlib import Path
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError
from minirospy.course import snapshot
from minirospy.course.snapshot import write_snapshot


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    source = tmp_path / "catkin_ws" / "src"
    for name, text in {
        "rpi_test/package.xml": "<package/>",
        "rpi_test/scripts/my_led.py": "import rospy\n",
        "rpi_test/.env": "PASSWORD=secret\n",
        ".git/config": "token\n",
        "rpi_test/__pycache__/x.pyc": "x",
        "rpi_test/big.bag": "x" * 1_000_001,
    }.items():
        file = source / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(source))
    return source


def test_snapshot_has_the_sources_the_doctor_and_the_results(workspace: Path, tmp_path: Path) -> None:
    file = tmp_path / "anna.zip"
    count, large = write_snapshot(file, Environment.read())
    assert count == 2
    assert [*large] == [str(workspace / "rpi_test" / "big.bag")]
    with zipfile.ZipFile(file) as archive:
        assert sorted(archive.namelist()) == [
            "catkin_ws/rpi_test/package.xml",
            "catkin_ws/rpi_test/scripts/my_led.py",
            "doctor.txt",
            "results.json",
            "variables.txt",
        ]
        assert "minirospy" in archive.read("doctor.txt").decode()
        assert json.loads(archive.read("results.json"))["exercises"] == {}
        assert f"ROS_PACKAGE_PATH={workspace}" in archive.read("variables.txt").decode()


def test_file_that_exists_is_kept(workspace: Path, tmp_path: Path) -> None:
    file = tmp_path / "anna.zip"
    file.write_text("mine")
    with pytest.raises(MinirospyError, match="exists: name another file"):
        write_snapshot(file, Environment.read())
    assert file.read_text() == "mine"


def test_terminal_without_a_workspace_is_told_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(MinirospyError, match=r"source WORKSPACE/devel/setup.bash"):
        write_snapshot(tmp_path / "anna.zip", Environment.read())
    assert not (tmp_path / "anna.zip").exists()


def test_snapshot_in_the_workspace_does_not_contain_itself(workspace: Path) -> None:
    file = workspace / "zoe.zip"
    (workspace / "rpi_test" / "noise.bin").write_bytes(os.urandom(5000))
    count, _ = write_snapshot(file, Environment.read())
    assert count == 3
    with zipfile.ZipFile(file) as archive:
        assert not [name for name in archive.namelist() if name.endswith(".zip")]


def test_all_files_together_have_a_limit(
    workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshot, "MAX_BYTES", 20)
    count, left_out = write_snapshot(tmp_path / "anna.zip", Environment.read())
    assert count == 1  # package.xml has 10 bytes, my_led.py has 13
    assert [*left_out] == [
        str(workspace / "rpi_test" / "big.bag"),
        str(workspace / "rpi_test" / "scripts" / "my_led.py"),
    ]


def test_file_that_is_too_large_is_not_read(
    workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    really_open = Path.open

    def noted_open(path: Path, *args: Any, **kwargs: Any) -> Any:
        opened.append(path.name)
        return really_open(path, *args, **kwargs)

    monkeypatch.setattr(Path, "open", noted_open)
    write_snapshot(tmp_path / "anna.zip", Environment.read())
    assert "my_led.py" in opened
    assert "big.bag" not in opened


def test_file_of_1970_is_packed(workspace: Path, tmp_path: Path) -> None:
    os.utime(workspace / "rpi_test" / "package.xml", (0, 0))
    file = tmp_path / "anna.zip"
    write_snapshot(file, Environment.read())
    with zipfile.ZipFile(file) as archive:
        assert archive.getinfo("catkin_ws/rpi_test/package.xml").date_time[:3] == (1980, 1, 1)


def test_files_that_cannot_be_read_any_more_are_left_out(
    workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone, folder = workspace / "rpi_test" / "gone.py", workspace / "rpi_test" / "folder.py"
    for each in (gone, folder):
        each.write_text("1")
    opened = zipfile.ZipFile.__init__

    def change_after_the_listing(archive: zipfile.ZipFile, *args: Any, **kwargs: Any) -> None:
        if gone.exists():
            gone.unlink()
            folder.unlink()
            folder.mkdir()
        opened(archive, *args, **kwargs)

    monkeypatch.setattr(zipfile.ZipFile, "__init__", change_after_the_listing)
    file = tmp_path / "anna.zip"
    count, left_out = write_snapshot(file, Environment.read())
    assert count == 2
    assert sorted(left_out) == [str(workspace / "rpi_test" / "big.bag"), str(folder), str(gone)]
    assert left_out[str(gone)].startswith("it cannot be read: ")
    with zipfile.ZipFile(file) as archive:
        assert archive.testzip() is None
        assert "catkin_ws/rpi_test/scripts/my_led.py" in archive.namelist()


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root and Windows read every folder"
)
def test_folder_that_cannot_be_read_is_left_out(workspace: Path, tmp_path: Path) -> None:
    folder = workspace / "rpi_test" / "scripts"
    folder.chmod(0)
    try:
        count, left_out = write_snapshot(tmp_path / "anna.zip", Environment.read())
    finally:
        folder.chmod(0o755)
    assert count == 1
    assert left_out[str(folder)] == "it cannot be read: Permission denied"


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_unfinished_snapshot_is_removed(
    error: BaseException, workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(zipfile.ZipFile, "writestr", fail)
    file = tmp_path / "anna.zip"
    with pytest.raises((MinirospyError, KeyboardInterrupt)):
        write_snapshot(file, Environment.read())
    assert not file.exists()
