"""xacro as a command, from its package, in launch files and in Python programs, for any PATH."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.workspace.packages import Packages
from tests.cli.conftest import BIN

MACROS = """<?xml version="1.0"?>
<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="side" default="links ü"/>
  <link name="$(find std_msgs)"/>
  <link name="$(arg side)"/>
  <link name="${2 * 3}"/>
</robot>
"""
FOUND = str(Packages().find("std_msgs"))


@pytest.fixture
def macros(tmp_path: Path) -> Path:
    file = tmp_path / "my robot.xacro"
    file.write_text(MACROS, encoding="utf-8")
    return file


def run(*words: str | Path, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*map(str, words)],
        capture_output=True,
        encoding="utf-8",
        timeout=60,
        check=False,
        env={**os.environ, **variables},
    )


def program(name: str) -> list[str]:
    return Packages().find_executable("xacro", name)


@pytest.mark.parametrize("name", ["script", "xacro", "xacro.py", "verb"])
def test_packages_and_arguments_are_found(name: str, macros: Path) -> None:
    scripts = {"script": [str(BIN / "xacro")], "verb": [str(BIN / "rosrun"), "xacro", "xacro"]}
    # Run xacro with a code page that cannot encode the file's characters.
    done = run(
        *(scripts.get(name) or program(name)), macros, "--inorder", "--xacro-ns", PYTHONIOENCODING="cp437"
    )
    assert done.returncode == 0, done.stderr
    assert [f'<link name="{value}"/>' in done.stdout for value in (FOUND, "links ü", "6")] == [True] * 3


def test_launch_files_need_no_path_of_programs(macros: Path, tmp_path: Path) -> None:
    commands = [
        "xacro '{}'",
        "xacro.py '{}'",
        "$(find xacro)/xacro '{}'",
        "$(find xacro)/xacro.py --inorder '{}'",
    ]
    params = "".join(
        f'<param name="p{number}" command="{command.format(macros)}"/>'
        for number, command in enumerate(commands)
    )
    file = tmp_path / "all.launch"
    file.write_text(f"<launch>{params}</launch>", encoding="utf-8")
    done = run(sys.executable, "-m", "minirospy", "launch", "--dump-params", file, PATH=os.defpath)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count(f'<link name=\\"{FOUND}\\"/>') == len(commands)


def test_python_programs_find_packages(macros: Path) -> None:
    code = "import sys, xacro; print(xacro.process_file(sys.argv[1]).toxml())"
    assert FOUND in run(sys.executable, "-c", code, macros).stdout


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot", "XML parsing error"),
        (MACROS.replace("std_msgs", "std_msg"), "error: resource not found: std_msg; did you mean std_msgs"),
        (MACROS.replace("2 * 3", "nothing"), "name 'nothing' is not defined"),
        (None, "error: No such file or directory"),
    ],
)
def test_unprocessable_files_are_reported_without_a_traceback(
    text: str | None, words: str, tmp_path: Path
) -> None:
    file = tmp_path / "a.xacro"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    done = run(BIN / "xacro", file)
    assert done.returncode == 2
    assert done.stderr.count(words) == 1
    assert "Traceback" not in done.stderr


def test_usage_is_that_of_xacro() -> None:
    done = run(BIN / "xacro")
    assert done.returncode == 2
    assert "Usage: xacro [options] <input>" in done.stderr
    assert "expected exactly one input file as argument" in done.stderr
    assert run(BIN / "xacro", "-h").returncode == 0


def test_real_index_of_packages_comes_first(tmp_path: Path) -> None:
    folder = tmp_path / "ament_index_python"
    folder.mkdir()
    (folder / "__init__.py").write_text("real = True\n", encoding="utf-8")
    code = "import ament_index_python; print(ament_index_python.real)"
    assert run(sys.executable, "-c", code, PYTHONPATH=str(tmp_path)).stdout == "True\n"
