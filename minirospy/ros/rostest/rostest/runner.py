"""rostest.runner: makes a launch file's tests available to unittest, as a class. Source: http://wiki.ros.org/rostest."""

from __future__ import annotations

import os
import sys
import unittest
from collections.abc import Callable
from typing import TypeAlias

from minirospy.ros.roslaunch.roslaunch.config import ROSLaunchConfig, load_config_default
from minirospy.ros.roslaunch.roslaunch.core import Test
from minirospy.ros.roslaunch.roslaunch.launch import RLTestTimeoutException
from minirospy.ros.roslib.roslib.packages import find_node
from minirospy.ros.rospkg.rospkg.common import ResourceNotFound
from minirospy.ros.rostest.rostest.rostest_parent import ROSTestLaunchParent
from minirospy.ros.rostest.rostest.rostestutil import printlog, printlogerr, printRostestSummary
from minirospy.ros.rosunit.runner.junit import Result, read
from minirospy.ros.rosunit.runner.unit import XML_OUTPUT_FLAG, xml_results_file

__all__ = [
    "_DEFAULT_TEST_PORT",
    "ROSTestLaunchParent",
    "_accumulateResults",
    "_addRostestParent",
    "createUnitTest",
    "failDuplicateRunner",
    "failRunner",
    "getConfig",
    "getResults",
    "getRostestParents",
    "printRostestSummary",
    "printlog",
    "printlogerr",
    "rostestRunner",
    "setTextMode",
    "setUp",
    "tearDown",
]

_DEFAULT_TEST_PORT = 22422


class _Run:
    """State of this process's test run."""

    def __init__(self) -> None:
        self.results = Result("rostest")
        self.parents: list[ROSTestLaunchParent] = []
        self.config: ROSLaunchConfig | None = None
        self.is_text = False


_run = _Run()


class RosTestCase(unittest.TestCase):
    """Declares the attributes of the classes returned by :func:`createUnitTest`. Programs may define such classes too."""

    config: ROSLaunchConfig
    test_file: str
    test_parent: ROSTestLaunchParent | None
    reuse_master = False
    clear = False


TestMethod: TypeAlias = Callable[[RosTestCase], None]


def getResults() -> Result:
    """Return the combined results of the tests so far."""
    return _run.results


def getConfig() -> ROSLaunchConfig | None:
    """Return the last test's configuration, or None before the first test."""
    return _run.config


def getRostestParents() -> list[ROSTestLaunchParent]:
    """Return the launches of all tests, to be torn down at the end."""
    return _run.parents


def _accumulateResults(results: Result) -> None:
    """Add a test's results to those that :func:`getResults` returns."""
    _run.results.accumulate(results)


def _addRostestParent(runner: ROSTestLaunchParent) -> None:
    """Add a launch to :func:`getRostestParents`, and make :func:`getConfig` return its configuration."""
    _run.parents.append(runner)
    _run.config = runner.config


def setTextMode(val: bool) -> None:
    """Set whether tests print their results instead of writing result files."""
    _run.is_text = val


def failRunner(testName: str, message: str) -> TestMethod:
    """Return a test method that fails with this message."""

    def fn(self: RosTestCase) -> None:
        print(message, file=sys.stderr)
        self.fail(message)

    return fn


def failDuplicateRunner(testName: str) -> TestMethod:
    """Return a test method that fails because several tests have the same name."""

    def fn(self: RosTestCase) -> None:
        print(f"Duplicate tests named [{testName}] in rostest suite")
        self.fail(f"Duplicate tests named [{testName}] in rostest suite")

    return fn


def rostestRunner(test: Test, test_pkg: str, results_base_dir: str | None = None) -> TestMethod:
    """Return a test method that launches the nodes and runs a ``<test>``, retrying as often as the tag allows.

    The method reads the results from the test's XML file, in the package's folder below ``results_base_dir``.
    """

    def fn(self: RosTestCase) -> None:
        arguments = test.args
        while True:
            assert self.test_parent is not None, "ROSTestParent initialization failed"
            printlog("Running test [%s]", test.test_name)
            _, failed = self.test_parent.launch()
            if failed:
                self.fail(f"Test Fixture Nodes {failed} failed to launch")

            place = {"ROS_TEST_RESULTS_DIR": results_base_dir} if results_base_dir else None
            file = xml_results_file(test_pkg, test.test_name, False, place)
            if os.path.exists(file):
                os.remove(file)
            words = [arguments, f"{XML_OUTPUT_FLAG}{file}", *(["--text"] if _run.is_text else [])]
            test.args = " ".join(filter(None, words))
            if _run.is_text:
                test.output = "screen"

            is_late = False
            try:
                passed = self.test_parent.run_test(test)
            except RLTestTimeoutException:
                if not test.retry:
                    raise
                passed, is_late = False, True
            if _run.is_text:
                if not passed:
                    self.fail(f"test [{test.test_name}] ended with a status other than 0")
                return

            if not is_late:
                if not os.path.isfile(file):
                    self.fail(f"test [{test.test_name}] did not generate test results")
                printlog("test [%s] results are in [%s]", test.test_name, file)
            results = Result("") if is_late else read(file, f"{test_pkg}/{test.test_name}")
            if test.retry > 0 and (is_late or results.num_errors or results.num_failures):
                test.retry -= 1
                printlogerr("test [%s] failed, retrying. Retries left: %s", test.test_name, test.retry)
                self.tearDown()
                self.setUp()
                continue
            _accumulateResults(results)
            return

    return fn


def setUp(self: RosTestCase) -> None:
    """Prepare a test's launch. The classes from createUnitTest() use this function as their setUp method."""
    self.test_parent = ROSTestLaunchParent(
        self.config, [self.test_file], reuse_master=self.reuse_master, clear=self.clear
    )
    self.test_parent.setUp()
    self.config = self.test_parent.config
    _addRostestParent(self.test_parent)
    printlog("setup[%s] run_id[%s] done", self.test_file, self.test_parent.run_id)


def tearDown(self: RosTestCase) -> None:
    """Terminate a test's launch. The classes from createUnitTest() use this function as their tearDown method."""
    printlog("tearDown[%s]", self.test_file)
    if self.test_parent:
        self.test_parent.tearDown()
    printlog("rostest teardown %s complete", self.test_file)


def createUnitTest(
    pkg: str,
    test_file: str,
    reuse_master: bool = False,
    clear: bool = False,
    results_base_dir: str | None = None,
) -> type[unittest.TestCase]:
    """Return a TestCase class with a launch file's tests. Raise RLException if the file is unreadable."""
    config = load_config_default([test_file], None)
    methods: dict[str, TestMethod] = {}
    for test in config.tests:
        name = f"test{test.test_name}"
        node = f"{test.package}/{test.type}"
        try:
            why = (
                ""
                if find_node(test.package, test.type)
                else f"Test node [{node}] does not exist or is not executable"
            )
        except ResourceNotFound:
            why = f"Package [{test.package}] for test node [{node}] does not exist"
        if why:
            methods[name] = failRunner(test.test_name, why)
        elif name in methods:
            methods[name] = failDuplicateRunner(test.test_name)
        else:
            methods[name] = rostestRunner(test, pkg, results_base_dir)
    members: dict[str, object] = {
        "__module__": "rostest.runner",
        "setUp": setUp,
        "tearDown": tearDown,
        "config": config,
        "test_parent": None,
        "test_file": test_file,
        "reuse_master": reuse_master,
        "clear": clear,
        **methods,
    }
    return type("RosTest", (RosTestCase,), members)
