"""rostest.rostestutil, provided by minirospy: names, files and summaries of tests."""

from minirospy.ros.rostest.rostest.rostestutil import (
    createXMLRunner,
    printlog,
    printlogerr,
    printRostestSummary,
    printSummary,
    xmlResultsFile,
)
from minirospy.ros.rostest.runner.junit import failure_junit_xml as test_failure_junit_xml
from minirospy.ros.rostest.runner.junit import success_junit_xml as test_success_junit_xml
from minirospy.ros.rostest.runner.unit import rostest_name_from_path

__all__ = [
    "createXMLRunner",
    "printRostestSummary",
    "printSummary",
    "printlog",
    "printlogerr",
    "rostest_name_from_path",
    "test_failure_junit_xml",
    "test_success_junit_xml",
    "xmlResultsFile",
]
