"""Programs whose folder contains a file with the name of a package that they import."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

FILES = {
    # As catkin_make generates it.
    "devel/robot/__init__.py": "",
    "devel/robot/msg/__init__.py": "from robot.msg._Speed import *\n",
    "devel/robot/msg/_Speed.py": "class Speed: pass\n",
    "devel/robot/tools.py": "NAME = 'tools'\n",
    "devel/single.py": "raise AssertionError\n",
}


def run(folder: Path, program: str, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *options, program],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder / "devel"), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "scripts").mkdir()
    return tmp_path


def test_program_with_the_name_of_its_package(folder: Path) -> None:
    (folder / "scripts" / "robot.py").write_text("""
print("runs")
import rospy
from robot.msg import Speed
from robot import tools
print(Speed.__name__, tools.NAME)
""")
    done = run(folder, "scripts/robot.py")
    assert (done.stdout, done.stderr) == ("runs\nSpeed tools\n", "")


def test_program_that_runs_the_one_in_the_source_folder(folder: Path) -> None:
    """catkin_make's copy of a program sets __file__ to the source."""
    source = folder / "src" / "robot.py"
    source.parent.mkdir()
    source.write_text("import rospy\nfrom robot.msg import Speed\nprint(Speed.__name__)\n")
    (folder / "scripts" / "robot.py").write_text(f"""
__file__ = {str(source)!r}
with open(__file__, "rb") as _source:
    exec(compile(_source.read(), __file__, "exec"))
""")
    done = run(folder, "scripts/robot.py")
    assert (done.stdout, done.stderr) == ("Speed\n", "")


def test_module_with_the_name_of_a_package_is_both(folder: Path) -> None:
    (folder / "scripts" / "robot.py").write_text("class Robot: pass\n")
    (folder / "scripts" / "drive.py").write_text("""
import rospy
from robot import Robot
from robot.msg import Speed
import robot.tools
print(Robot.__module__, Speed.__name__, robot.tools.NAME)
""")
    done = run(folder, "scripts/drive.py")
    assert (done.stdout, done.stderr) == ("robot Speed tools\n", "")


@pytest.mark.parametrize("options", [[], ["-m"]])
def test_other_imports_are_unchanged(folder: Path, options: list[str]) -> None:
    (folder / "scripts" / "single.py").write_text("import rospy, helper\nprint(helper.__file__)\n")
    (folder / "scripts" / "helper.py").write_text("")
    done = run(folder / "scripts", "single" if options else "single.py", *options)
    assert (done.stdout, done.stderr) == (f"{folder / 'scripts' / 'helper.py'}\n", "")
