"""rostest.runner: programs that run a launch file's tests with unittest. The package `tested` is in this folder."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import rostest.runner
from rosunit.junitxml import Result

HERE = Path(__file__).parent

PROGRAM = """\
import sys, unittest
import rostest.runner

case = rostest.runner.createUnitTest("tested", sys.argv[1])
suite = unittest.TestLoader().loadTestsFromTestCase(case)
result = unittest.TestResult()
suite.run(result)
for parent in rostest.runner.getRostestParents():
    parent.tearDown()
print("RAN", result.testsRun, len(rostest.runner.getRostestParents()), sorted(rostest.runner.getConfig().params))
for kind in ("errors", "failures"):
    for test, text in getattr(result, kind):
        print(kind, test.id(), text.strip().splitlines()[-1])
written = rostest.runner.getResults()
print("WRITTEN", written.name, written.num_tests, written.num_errors, written.num_failures)
"""


def run_program(program: str, file: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(HERE))
    monkeypatch.setenv("ROS_HOME", str(folder))
    monkeypatch.setenv("ROS_LOG_DIR", str(folder / "log"))
    done = subprocess.run(
        [sys.executable, "-c", program, str(file)], capture_output=True, text=True, check=True, timeout=100
    )
    return done.stdout


def test_unittest_runs_the_tests_of_a_launch_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "some.test"
    file.write_text(
        """<launch>
        <param name="p" value="3"/>
        <test test-name="good" pkg="tested" type="good.py"/>
        <test test-name="bad" pkg="tested" type="bad.py"/>
        <test test-name="sleepy" pkg="tested" type="sleepy.py" time-limit="0.5"/>
        <test test-name="gone" pkg="tested" type="no_such.py"/>
        <test test-name="twice" pkg="tested" type="good.py" name="one"/>
        <test test-name="twice" pkg="tested" type="good.py" name="other"/>
        </launch>"""
    )
    said = run_program(PROGRAM, file, tmp_path, monkeypatch)
    lines = [
        line
        for line in said.splitlines()
        if line.startswith(("RAN", "errors", "failures rostest", "WRITTEN"))
    ]
    assert lines == [
        "RAN 5 5 ['/p', '/rosdistro', '/rosversion']",
        "errors rostest.runner.RosTest.testsleepy minirospy.ros.roslaunch.roslaunch.launch.RLTestTimeoutException: "
        "max time [0.5s] allotted for test [sleepy] of type [tested/sleepy.py]",
        "failures rostest.runner.RosTest.testgone AssertionError: "
        "Test node [tested/no_such.py] does not exist or is not executable",
        "failures rostest.runner.RosTest.testtwice AssertionError: Duplicate tests named [twice] in rostest suite",
        "WRITTEN rostest 6 1 1",
    ]


OWN = """\
import sys
import roslaunch
from rostest.rostest_parent import ROSTestLaunchParent

config = roslaunch.config.load_config_default([sys.argv[1]], 0)
parent = ROSTestLaunchParent(config, [sys.argv[1]])
parent.setUp()
print("STARTED", parent.launch()[1])
print("PASSED", parent.run_test(config.tests[0]))
parent.tearDown()
parent.tearDown()
try:
    ROSTestLaunchParent(None, [])
except Exception as error:
    print("WITHOUT", type(error).__name__, error)
"""


def test_programs_launch_and_run_a_test_themselves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "one.test"
    file.write_text('<launch><test test-name="good" pkg="tested" type="good.py"/></launch>')
    said = run_program(OWN, file, tmp_path, monkeypatch)
    lines = [line for line in said.splitlines() if line.startswith(("STARTED", "PASSED", "WITHOUT"))]
    assert lines == ["STARTED []", "PASSED True", "WITHOUT Exception config not initialized"]


def test_programs_add_results_and_launches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs with runners of their own call these private functions of rostest.runner."""
    from minirospy.ros.rostest.rostest.runner import _Run

    monkeypatch.setattr("minirospy.ros.rostest.rostest.runner._run", _Run())
    added = Result("one")
    added.num_tests, added.num_failures = 3, 1
    rostest.runner._accumulateResults(added)
    rostest.runner._accumulateResults(added)
    results = rostest.runner.getResults()
    assert (results.num_tests, results.num_failures) == (6, 2)

    launch: Any = SimpleNamespace(config="config")
    rostest.runner._addRostestParent(launch)
    assert rostest.runner.getRostestParents() == [launch]
    config: object = rostest.runner.getConfig()
    assert config == "config"
