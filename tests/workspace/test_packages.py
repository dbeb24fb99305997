"""workspace/packages: the locations of packages, and their programs."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import NotFoundError
from minirospy.workspace.packages import NotExecutableError, Packages


def make_package(folder: Path, name: str) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    return folder


def packages(*roots: Path) -> Packages:
    return Packages(Environment.read({"ROS_PACKAGE_PATH": os.pathsep.join(map(str, roots))}))


def test_built_in_packages_are_found() -> None:
    found = packages()
    assert {"std_msgs", "rpi_feros", "rpi_feros_bringup", "rpi_msgs"} <= set(found.names())
    assert (found.find("std_msgs") / "msg" / "Bool.msg").is_file()


def test_the_name_is_that_in_package_xml(tmp_path: Path) -> None:
    folder = make_package(tmp_path / "src" / "a_folder", "its_name")
    assert packages(tmp_path).find("its_name") == folder


def test_workspace_overrides_built_in_packages(tmp_path: Path) -> None:
    folder = make_package(tmp_path / "rpi_feros", "rpi_feros")
    assert packages(tmp_path).find("rpi_feros") == folder
    assert packages(tmp_path).folders()["rpi_feros"] == folder


def test_the_first_folder_wins_even_with_a_deeper_package(tmp_path: Path) -> None:
    deep = make_package(tmp_path / "one" / "group" / "pkg", "pkg")
    make_package(tmp_path / "two" / "pkg", "pkg")
    assert packages(tmp_path / "one", tmp_path / "two").find("pkg") == deep


def test_ignored_folders_are_not_searched(tmp_path: Path) -> None:
    make_package(tmp_path / "off" / "a", "a")
    (tmp_path / "off" / "CATKIN_IGNORE").touch()
    make_package(tmp_path / ".hidden" / "b", "b")
    outer = make_package(tmp_path / "c", "c")
    make_package(outer / "inner", "d")
    assert not {"a", "b", "d"} & set(packages(tmp_path).names())
    assert "c" in packages(tmp_path).names()


def test_a_typing_error_is_answered_with_the_nearest() -> None:
    with pytest.raises(NotFoundError, match="did you mean rpi_feros"):
        packages().find("rpi_fero")


def test_programs(tmp_path: Path) -> None:
    folder = make_package(tmp_path / "pkg", "pkg")
    scripts = folder / "scripts"
    scripts.mkdir()
    (scripts / "node.py").write_text("print(1)")
    (scripts / "tool").write_text("#!/usr/bin/env python3\n")
    (scripts / "notes.txt").write_text("no program")
    found = packages(tmp_path)
    # Python programs run with this interpreter, with or without the executable bit.
    assert found.find_executable("pkg", "node.py") == [sys.executable, str(scripts / "node.py")]
    assert found.find_executable("pkg", "tool") == [sys.executable, str(scripts / "tool")]
    assert "node.py" in found.executables("pkg")
    with pytest.raises(NotFoundError, match=r"did you mean node\.py"):
        found.find_executable("pkg", "nod.py")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no executable bit")
def test_a_program_that_is_not_executable_is_reported(tmp_path: Path) -> None:
    folder = make_package(tmp_path / "pkg", "pkg")
    program = folder / "run.sh"
    program.write_text("#!/bin/sh\n")
    with pytest.raises(NotExecutableError, match=r"chmod \+x"):
        packages(tmp_path).find_executable("pkg", "run.sh")
    program.chmod(0o755)
    assert packages(tmp_path).find_executable("pkg", "run.sh") == [str(program)]


def test_files_of_a_package() -> None:
    found = packages()
    assert found.find_resource("rpi_feros_bringup", "rpi_led.launch").is_file()
    with pytest.raises(NotFoundError, match=r"did you mean rpi_led\.launch"):
        found.find_resource("rpi_feros_bringup", "rpi_let.launch")
