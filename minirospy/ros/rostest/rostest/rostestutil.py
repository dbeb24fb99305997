"""rostest.rostestutil: the output of the command `rostest`, for programs that run tests. Source: http://wiki.ros.org/rostest."""

from __future__ import annotations

import logging
import sys
from typing import TYPE_CHECKING

from minirospy.ros.rosunit.runner.junit import failure_junit_xml as test_failure_junit_xml
from minirospy.ros.rosunit.runner.junit import success_junit_xml as test_success_junit_xml
from minirospy.ros.rosunit.runner.unit import (
    create_xml_runner,
    print_runner_summary,
    print_unittest_summary,
    rostest_name_from_path,
    xml_results_file,
)

if TYPE_CHECKING:
    import unittest

    from minirospy.ros.rosunit.runner.junit import Result

__all__ = [
    "createXMLRunner",
    "getErrors",
    "printRostestSummary",
    "printSummary",
    "printlog",
    "printlogerr",
    "rostest_name_from_path",
    "test_failure_junit_xml",
    "test_success_junit_xml",
    "xmlResultsFile",
]

createXMLRunner = create_xml_runner
printSummary = print_unittest_summary
xmlResultsFile = xml_results_file

_logger = logging.getLogger("rostest")


def printlog(msg: str, *args: object) -> None:
    """Print and log a line, with ``args`` in place of its ``%s``."""
    text = msg % args if args else msg
    _logger.info("%s", text)
    print("[ROSTEST]" + text)


def printlogerr(msg: str, *args: object) -> None:
    """Print a line to stderr and log it as an error, with ``args`` in place of its ``%s``."""
    text = msg % args if args else msg
    _logger.error("%s", text)
    print("[ROSTEST]" + text, file=sys.stderr)


def printRostestSummary(result: unittest.TestResult, rostest_results: Result) -> None:
    """Print a summary of the runner's result and of the results reported by the test nodes."""
    print_runner_summary(result, rostest_results, "ROSTEST")


def getErrors() -> None:
    """Return None: the errors are in `rostest.runner.getResults()`."""
