"""rostest.rostestutil, provided by minirospy: names, files and summaries of tests."""

from minirospy.compat.rostest.rostestutil import (
    createXMLRunner,
    printlog,
    printlogerr,
    printRostestSummary,
    printSummary,
    xmlResultsFile,
)
from minirospy.testing.junit import failure_junit_xml as test_failure_junit_xml
from minirospy.testing.junit import success_junit_xml as test_success_junit_xml
from minirospy.testing.unit import rostest_name_from_path

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
