"""rosunit.junitxml: reads and writes test result files."""

from __future__ import annotations

import re

from minirospy.ros.rosunit.runner.junit import NOT_IN_XML as invalid_chars
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
    "cdata",
    "filter_nonprintable_text",
    "invalid_char_replacer",
    "invalid_chars",
    "print_summary",
    "python2",
    "read",
    "read_all",
    "test_failure_junit_xml",
    "test_success_junit_xml",
]

python2 = False


def invalid_char_replacer(m: re.Match[str]) -> str:
    """Return the replacement for a character that XML does not allow."""
    return f"&#x{ord(m.group(0)):04X};"


def cdata(cdata_text: str) -> str:
    """Wrap a string in a CDATA section."""
    return f"<![CDATA[\n{cdata_text}\n]]>"
