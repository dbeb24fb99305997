"""`catkin_make run_tests` and `catkin test`: run the tests listed in CMakeLists.txt, with results in catkin's folders."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from minirospy.base.installation import install_command
from minirospy.ros.catkin.commands.make import catkin_make
from minirospy.ros.catkin.commands.test_results import main as catkin_test_results
from minirospy.ros.catkin.commands.tool import catkin
from minirospy.workspace.plan import Test as PlannedTest
from minirospy.workspace.plan import read_plan
from tests.waiting import wait_until

if TYPE_CHECKING:
    from conftest import Scene


UNIT = """import os, unittest
from led_msgs.msg import Led

class Case(unittest.TestCase):
    def test_led(self):
        self.assertEqual(Led().number, int(os.environ.get("EXPECTED", "0")))

if __name__ == "__main__":
    import rosunit
    rosunit.unitrun("p", "case", Case)
"""
CMAKE = """if(CATKIN_ENABLE_TESTING)
  find_package(rostest REQUIRED)
  add_rostest(test/unit.test ARGS expected:=0 DEPENDENCIES ${catkin_EXPORTED_TARGETS})
  add_rostest(test/unit.test ARGS expected:=1)
  add_rostest_gtest(hardware_test test/hardware.test src/hardware.cpp)
  catkin_add_nosetests(test/nose TIMEOUT 10)
endif()"""
FILES = {
    "test/unit.py": UNIT,
    "test/unit.test": '<launch><arg name="expected"/><env name="EXPECTED" value="$(arg expected)"/>'
    '<test test-name="unit_$(arg expected)" pkg="p" type="unit.py"/></launch>',
    "test/nose/test_it.py": "def test_it():\n    pass\n",
}


def write(scene: Scene) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.package("p", CMAKE, "led_msgs", FILES)
    scene.package("q", "catkin_add_nosetests(test)", "", {"test/test_q.py": "def test_q():\n    pass\n"})


def test_a_plan_has_what_the_files_name(scene: Scene) -> None:
    write(scene)
    plan = read_plan(scene.source / "p")
    assert plan.tests == (
        PlannedTest("test/unit.test", "rostest", 5, ("expected:=0",)),
        PlannedTest("test/unit.test", "rostest", 6, ("expected:=1",)),
        PlannedTest("test/nose", "pytest", 8),
    )
    assert plan.skipped == ("hardware_test",)


def test_folders_of_tests_are_the_working_directory(
    scene: Scene, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """catkin's nosetests does the same; a single file runs in the package's build folder."""
    record = (
        f"import os\ndef test_it():\n    open({str(tmp_path / 'log')!r}, 'a').write(os.getcwd() + '\\n')\n"
    )
    folder = scene.package(
        "p",
        "catkin_add_nosetests(test)\ncatkin_add_nosetests(more/test_two.py)",
        "",
        {"test/test_one.py": record, "more/test_two.py": record},
    )

    assert catkin_make(["-C", str(scene.root), "run_tests"]) == 0, capfd.readouterr().out

    build = scene.root / "build" / "p"
    assert (tmp_path / "log").read_text(encoding="utf-8").splitlines() == [str(folder / "test"), str(build)]


def test_all_are_run(
    scene: Scene, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write(scene)
    assert catkin_make(["-C", str(scene.root), "run_tests_p"]) == 1
    out = capfd.readouterr().out

    for line in (
        "p: skipped, they need a C++ compiler: hardware_test",
        "p: rostest test/unit.test expected:=0\n",
        "[p.rosunit-unit_0/test_led][passed]",
        "[p.rosunit-unit_1/test_led][FAILURE]",
        "p: pytest test/nose\n",
        "Summary: 5 tests, 0 errors, 1 failures, 0 skipped",
    ):
        assert line in out

    assert "q: " not in out.split("p: pytest")[1]
    results = scene.root / "build" / "test_results"
    assert sorted(str(path.relative_to(results)) for path in results.rglob("*.xml")) == [
        "p/pytest-nose.xml",
        "p/rostest-test_unit__expected__0.xml",
        "p/rostest-test_unit__expected__1.xml",
        "p/rosunit-unit_0.xml",
        "p/rosunit-unit_1.xml",
    ]
    assert catkin_test_results([str(results)]) == 1
    assert catkin_make(["-C", str(scene.root), "run_tests_p_rostest_test_unit.test"]) == 1
    out = capfd.readouterr().out
    assert "p: rostest test/unit.test" in out
    assert "p: pytest" not in out
    monkeypatch.chdir(scene.source / "q")
    assert catkin(["test", "--this", "-j2"]) == 0
    assert "Summary: 1 tests, 0 errors, 0 failures, 0 skipped" in capfd.readouterr().out
    assert catkin(["test", "r"]) == 1
    assert "package or test [r] not found" in capfd.readouterr().err


def test_launch_files_are_checked(scene: Scene, capfd: pytest.CaptureFixture[str]) -> None:
    good = '<launch><node name="n" pkg="p" type="n.py"/></launch>'
    files = {
        "launch/good.launch": good,
        "launch/more/given.launch": '<launch><arg name="a"/></launch>',
        "n.py": "",
    }
    folder = scene.package("p", "roslaunch_add_file_check(launch IGNORE_UNSET_ARGS)", "", files)
    assert catkin_make(["-C", str(scene.root), "run_tests"]) == 0
    (folder / "launch" / "bad.launch").write_text(good.replace("n.py", "m.py").replace("><", ">\n<"))
    assert catkin_make(["-C", str(scene.root), "run_tests"]) == 1
    said = capfd.readouterr()
    assert "bad.launch:2: error: node [n]: executable [m.py] not found" in said.err
    assert "Summary: 1 tests, 0 errors, 1 failures, 0 skipped" in said.out
    assert (scene.root / "build" / "test_results" / "p" / "roslaunch-check_launch.xml").is_file()


def test_commands_that_cannot_be_run_are_errors(
    scene: Scene, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    scene.package("p", "add_rostest(test/no.test)")
    assert catkin_make(["-C", str(scene.root), "run_tests"]) == 1
    assert "CMakeLists.txt:3: test file [test/no.test] does not exist" in capsys.readouterr().err
    scene.package("q", "catkin_add_nosetests(test)", "", {"test/test_q.py": ""})
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert catkin_make(["-C", str(scene.root), "run_tests_q"]) == 1
    assert f"tests need pytest: {install_command('pytest')}" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="sends a Unix signal")
def test_ctrl_c_lets_a_test_end_its_nodes(scene: Scene, tmp_path: Path) -> None:
    started, ended = tmp_path / "started", tmp_path / "ended"
    text = f"""import pathlib, time
def test_slow():
    try:
        pathlib.Path({str(started)!r}).touch()
        time.sleep(60)
    finally:
        time.sleep(0.5)
        pathlib.Path({str(ended)!r}).touch()
"""
    scene.package("p", "catkin_add_nosetests(test)", "", {"test/test_slow.py": text})
    code = "import sys; from minirospy.ros.catkin.commands.make import catkin_make; sys.exit(catkin_make(['run_tests']))"
    popen = subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=scene.root,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    wait_until(lambda: started.exists() or popen.poll() is not None)
    os.killpg(popen.pid, signal.SIGINT)
    _, err = popen.communicate(timeout=30)

    assert popen.returncode == 1
    assert err.endswith("catkin_make: ERROR: interrupted: the tests that were left have not run\n")
    assert ended.exists()


def test_no_test_outlives_a_ctrl_c_that_comes_when_it_begins(
    scene: Scene,
    interrupted_processes: list[subprocess.Popen[bytes]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    scene.package(
        "p", "catkin_add_nosetests(test)", "", {"test/test_slow.py": "import time\ntime.sleep(60)\n"}
    )
    monkeypatch.setattr("minirospy.ros.catkin.commands.run_tests._END_SECONDS", 0.1)
    assert catkin_make(["-C", str(scene.root), "run_tests"]) == 1
    assert capsys.readouterr().err.endswith("interrupted: the tests that were left have not run\n")
    assert [each.returncode is None for each in interrupted_processes] == [False]


def test_a_file_where_a_folder_belongs(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    scene.package("p", "", "", {})
    (scene.root / "devel").touch()
    assert catkin_make(["-C", str(scene.root)]) == 1
    assert capsys.readouterr().err == f"catkin_make: ERROR: {scene.root / 'devel'}: File exists\n"
