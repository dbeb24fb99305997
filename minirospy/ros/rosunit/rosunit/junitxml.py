"""rosunit.junitxml: reads and writes test result files."""

from minirospy.ros.rosunit.runner.junit import (
    Result,
    TestCaseResult,
    TestError,
    TestFailure,
    TestInfo,
    filter_nonprintable_text,
    print_summary,
    read,
    read_all,
)
from minirospy.ros.rosunit.runner.junit import failure_junit_xml as test_failure_junit_xml
from minirospy.ros.rosunit.runner.junit import success_junit_xml as test_success_junit_xml

__all__ = [
    "Result",
    "TestCaseResult",
    "TestError",
    "TestFailure",
    "TestInfo",
    "filter_nonprintable_text",
    "print_summary",
    "read",
    "read_all",
    "test_failure_junit_xml",
    "test_success_junit_xml",
]
