"""The workshop's exercises, solved in rpi_feros: their package tests as students run them, and their launch files."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.base.errors import MinirospyError
from minirospy.ros.catkin.commands.make import catkin_make
from minirospy.ros.roslaunch.launcher.files import find_files
from minirospy.ros.roslaunch.launcher.load import load_files
from minirospy.workspace.packages import Packages
from minirospy.workspace.plan import read_plan

ROOT = Path(__file__).parents[1]
TESTS = sorted(path.name for path in (ROOT / "rpi_feros" / "test").glob("*.test"))
EXERCISES = sorted({path.stem for path in (ROOT / "launch").glob("*.launch")} - {"workshop"})


@pytest.mark.parametrize("file", TESTS)
def test_solution_works_on_the_virtual_board(file: str) -> None:
    command = [sys.executable, "-m", "minirospy.ros.rostest.commands.rostest", "rpi_feros", file]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " * TESTS: 1\n" in done.stdout


def test_each_exercise_has_its_test() -> None:
    assert [Path(name).stem for name in TESTS] == EXERCISES
    plan = read_plan(ROOT / "rpi_feros")
    assert [Path(test.path).name for test in plan.tests] == TESTS
    programs = {Path(source).name for install in plan.installs for source in install.sources}
    assert programs == {
        path.name for path in (ROOT / "rpi_feros" / "scripts").iterdir() if path.suffix == ".py"
    }


@pytest.mark.parametrize("exercise", EXERCISES)
def test_one_launch_file_starts_all_robots(exercise: str) -> None:
    """workshop.launch runs the nodes in the exercise's own file, and every node in it has a program."""
    packages = Packages()

    def nodes(name: str, **args: str) -> list[tuple[str, str]]:
        spec = load_files([str(ROOT / "launch" / f"{name}.launch")], args, packages)
        return [(node.name, node.type) for node in spec.nodes]

    alone = nodes(exercise)
    assert nodes("workshop", exercise=exercise) == alone
    without = nodes("workshop", exercise=exercise, scanner="false")
    assert without == [node for node in alone if node[1] != "sick_safetyscanners_node"]
    for _, program in alone:
        package = "sick_safetyscanners" if program == "sick_safetyscanners_node" else "rpi_feros"
        assert packages.find_executable(package, program)


def test_argument_without_its_colon_is_refused() -> None:
    with pytest.raises(MinirospyError, match=r"an argument is written exercise:=sick_zone$"):
        find_files(["rpi_feros_bringup", "workshop.launch", "exercise=sick_zone"], Packages())


def test_solutions_run_in_a_copied_workspace(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """catkin_make accepts the solutions' CMakeLists.txt."""
    source = tmp_path / "src"
    source.mkdir()
    for name in ("rpi_feros", "launch"):
        (source / name).symlink_to(ROOT / name, target_is_directory=True)
    assert catkin_make(["-C", str(tmp_path), "install"]) == 0
    assert "WARNING" not in capsys.readouterr().err
    assert (tmp_path / "install" / "lib" / "rpi_feros" / "led_actuator.py").is_file()
    assert (tmp_path / "install" / "share" / "rpi_feros_bringup" / "run_led.yaml").is_file()
