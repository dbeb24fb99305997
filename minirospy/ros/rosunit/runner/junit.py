"""Reads, writes and prints test results as JUnit XML in rosunit's format. ``rosunit.junitxml`` re-exports this module.

Source: http://wiki.ros.org/rosunit (the files), https://llg.cubic.org/docs/junit/ (the format).
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import ClassVar
from xml.etree import ElementTree

from minirospy.base import private_files
from minirospy.base.xml_text import XmlError, check_xml

__all__ = [
    "NOT_IN_XML",
    "Result",
    "TestCaseResult",
    "TestError",
    "TestFailure",
    "TestInfo",
    "coloured",
    "failure_junit_xml",
    "filter_nonprintable_text",
    "headline",
    "names_of",
    "print_summary",
    "read",
    "read_all",
    "report",
    "success_junit_xml",
]

_WIDTH = 80
NOT_IN_XML = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_RED, _GREEN = "1;31", "32"


class TestInfo:
    """A test case's error: the exception's name, and its message with the traceback."""

    kind: ClassVar[str] = ""
    word: ClassVar[str] = ""

    def __init__(self, type_: str, text: str) -> None:
        self.type = type_
        self.text = text

    def xml_element(self) -> ElementTree.Element:
        """Return the error as an XML element inside a test case."""
        element = ElementTree.Element(self.kind, {"type": self.type})
        element.text = filter_nonprintable_text(self.text)
        return element

    def xml(self) -> bytes:
        """Return the XML element as bytes."""
        return ElementTree.tostring(self.xml_element())


class TestError(TestInfo):
    """An unexpected exception in a test case."""

    kind = "error"
    word = "ERROR"


class TestFailure(TestInfo):
    """A failed assertion in a test case."""

    kind = "failure"
    word = "FAILURE"


class TestCaseResult:
    """A test case: its name and class, duration in seconds, and errors.

    ``skipped`` is the reason for not running the case.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.classname = ""
        self.time: float = 0.0
        self.errors: list[TestInfo] = []
        self.failures: list[TestInfo] = []
        self.skipped: str | None = None

    @property
    def passed(self) -> bool:
        """Return whether the case has no errors and no failures."""
        return not self.errors and not self.failures

    @property
    def description(self) -> str:
        """Return the case's lines for the printed summary."""
        if self.passed:
            return f"[{self.name}][passed]\n"
        return "".join(
            f"{headline(f'[{self.name}][{info.word}]')}\n{info.text.rstrip()}\n{'-' * _WIDTH}\n\n"
            for info in (*self.failures, *self.errors)
        )

    @property
    def line(self) -> str:
        """Return the line to print after running the case."""
        lines = [f"[Testcase: {self.name}] ... ok"]
        for info in (*self.failures, *self.errors):
            lines[0] = f"[Testcase: {self.name}] ... {info.word}!"
            lines += [f"{info.word}: {filter_nonprintable_text(info.text).rstrip()}", "-" * _WIDTH]
        return "\n".join(lines)

    def add_error(self, error: TestInfo) -> None:
        """Add an error."""
        self.errors.append(error)

    def add_failure(self, failure: TestInfo) -> None:
        """Add a failure."""
        self.failures.append(failure)

    def xml_element(self) -> ElementTree.Element:
        """Return the case as an XML element inside a test suite."""
        attributes = {"classname": self.classname, "name": self.name, "time": f"{self.time:.4f}"}
        element = ElementTree.Element("testcase", attributes)
        if self.skipped is not None:
            ElementTree.SubElement(element, "skipped", {"message": filter_nonprintable_text(self.skipped)})
        element.extend(info.xml_element() for info in (*self.failures, *self.errors))
        return element

    def xml(self) -> bytes:
        """Return the XML element as bytes."""
        return ElementTree.tostring(self.xml_element())


class Result:
    """A test suite's results: counts, captured output and cases."""

    def __init__(self, name: str, num_errors: int = 0, num_failures: int = 0, num_tests: int = 0) -> None:
        self.name = name
        self.num_errors = num_errors
        self.num_failures = num_failures
        self.num_tests = num_tests
        self.test_case_results: list[TestCaseResult] = []
        self.system_out = ""
        self.system_err = ""
        self.time: float = 0.0

    def accumulate(self, r: Result) -> None:
        """Add the results of another suite."""
        self.num_errors += r.num_errors
        self.num_failures += r.num_failures
        self.num_tests += r.num_tests
        self.time += r.time
        self.test_case_results += r.test_case_results
        self.system_out = "\n".join(filter(None, (self.system_out, r.system_out)))
        self.system_err = "\n".join(filter(None, (self.system_err, r.system_err)))

    def add_test_case_result(self, r: TestCaseResult) -> None:
        """Add a case without changing the counts."""
        self.test_case_results.append(r)

    def add_case(self, case: TestCaseResult) -> None:
        """Add a case and count it."""
        self.add_test_case_result(case)
        self.num_tests += 1
        self.num_errors += bool(case.errors)
        self.num_failures += bool(case.failures)
        self.time += case.time

    def xml_element(self) -> ElementTree.Element:
        """Return the XML file's root element."""
        attributes = {
            "errors": str(self.num_errors),
            "failures": str(self.num_failures),
            "name": self.name,
            "tests": str(self.num_tests),
            "time": f"{self.time:.3f}",
        }
        suite = ElementTree.Element("testsuite", attributes)
        suite.extend(case.xml_element() for case in self.test_case_results)
        for tag, text in (("system-out", self.system_out), ("system-err", self.system_err)):
            ElementTree.SubElement(suite, tag).text = filter_nonprintable_text(text)
        return suite

    def xml(self) -> bytes:
        """Return the XML file's content."""
        text: bytes = ElementTree.tostring(self.xml_element(), encoding="utf-8", xml_declaration=True)
        return text

    def write(self, file: Path) -> None:
        """Write the file atomically."""
        part = file.with_name(f"{file.name}.part")
        with os.fdopen(private_files.create_file(part, 0o666), "wb") as stream:
            stream.write(self.xml())
        private_files.replace_file(part, file)


# --- reading


def read(test_file: str | os.PathLike[str], test_name: str) -> Result:
    """Read the results in a file; name the cases ``package.rosunit-name/case``.

    If the file is invalid, print a warning and return no cases.
    """
    path = Path(test_file)
    if not path.is_file():
        print(f"WARN: cannot read test result file [{test_file}]: test file does not exist")
        return Result(test_name)
    try:
        check_xml(text := path.read_bytes())
        root = ElementTree.fromstring(text)
        suites = list(root.iter("testsuite"))
        if not suites:
            raise ValueError("it has no <testsuite>")
        result = Result(test_name)
        for suite in suites:
            result.accumulate(_read_suite(suite, f"{path.parent.name}.{path.stem}", test_name))
    except (ElementTree.ParseError, XmlError, ValueError) as error:
        print(f"WARN: cannot read test result file [{test_file}]: {error}")
        return Result(test_name)
    return result


def read_all(filter_: Sequence[str] = ()) -> Result:
    """Read all results in the results folder, for the packages in ``filter_`` (default: all).

    Skip the results of rostest itself.
    """
    from minirospy.workspace.folders import results_dir

    root = Path(results_dir())
    results = Result("ros_test_results")
    for path in sorted(root.glob("*/*.xml")):
        if (not filter_ or path.parent.name in filter_) and not path.name.startswith("rostest-"):
            results.accumulate(read(path, f"{path.parent.name}/{path.stem}"))
    return results


def _read_suite(suite: ElementTree.Element, prefix: str, test_name: str) -> Result:
    counts = [int(suite.get(key, "0")) for key in ("errors", "failures", "tests")]
    result = Result(test_name, *counts)
    result.time = float(suite.get("time", "0"))

    for element in suite.iter("testcase"):
        case = TestCaseResult(f"{prefix}/{element.get('name')}")
        case.classname = element.get("classname") or ""
        case.time = float(element.get("time", "0"))
        for child in element:
            text = child.text or child.get("message") or ""
            if child.tag == "failure":
                case.add_failure(TestFailure(child.get("type") or "", text))
            elif child.tag == "error":
                case.add_error(TestError(child.get("type") or "", text))
            elif child.tag == "skipped":
                case.skipped = child.get("message") or ""
        result.add_test_case_result(case)

    result.system_out = suite.findtext("system-out") or ""
    result.system_err = suite.findtext("system-err") or ""
    return result


# --- printed output


def headline(text: str) -> str:
    """Pad a string with dashes to the line width."""
    return text.ljust(_WIDTH, "-")


def coloured(text: str, colour: str) -> str:
    """Wrap a string in a terminal colour code."""
    return f"\x1b[{colour}m{text}\x1b[0m"


def names_of(infos: Iterable[tuple[object, str]]) -> list[str]:
    """Return the test names from unittest's list of errors or failures."""
    return [str(getattr(test, "_testMethodName", test)) for test, _ in infos]


def report(results: Result, runner_name: str, errors: int = 0, failed: Sequence[str] = ()) -> str:
    """Return a line for each case, then the counts.

    ``errors`` and ``failed`` are the runner's own errors: the number and the names of tests that could not report results.
    """
    errors, failures = errors + results.num_errors, len(failed) + results.num_failures
    is_good = not errors and not failures
    lines = [headline(f"[{runner_name}]"), ""]
    lines.append("".join(case.description for case in results.test_case_results))
    lines[-1] += "".join(f"[{name}][failed]\n" for name in failed)
    lines += [
        "SUMMARY",
        coloured(" * RESULT: SUCCESS", _GREEN) if is_good else coloured(" * RESULT: FAIL", _RED),
    ]
    lines.append(f" * TESTS: {results.num_tests}")
    for word, count in (("ERRORS", errors), ("FAILURES", failures)):
        line = f" * {word}: {count}"
        lines.append(coloured(line, _RED) if count else line)
    if failed:
        lines += ["", "ERROR: The following tests failed to run:", *(f" * {name}" for name in failed)]
    return "\n".join([*lines, ""])


def print_summary(junit_results: Result, runner_name: str = "ROSUNIT") -> None:
    """Print each case, then the counts."""
    print(report(junit_results, runner_name))


# --- files with a single test result


def filter_nonprintable_text(text: str) -> str:
    """Escape characters that XML does not allow, for example as ``&#x001B;``."""
    return NOT_IN_XML.sub(lambda match: f"&#x{ord(match[0]):04X};", text)


def failure_junit_xml(
    test_name: str,
    message: str,
    stdout: str | None = None,
    class_name: str = "Results",
    testcase_name: str = "test_ran",
) -> bytes:
    """Return a results file with one failed test, for a test that could not write its own file."""
    suite, case = _single(test_name, 1, class_name, testcase_name)
    ElementTree.SubElement(case, "failure", {"message": message, "type": ""})
    if stdout is not None:
        element = ElementTree.SubElement(suite, "system-out")
        element.text = f"<![CDATA[\n{filter_nonprintable_text(stdout)}\n]]>"
    return ElementTree.tostring(suite)


def success_junit_xml(test_name: str, class_name: str = "Results", testcase_name: str = "test_ran") -> bytes:
    """Return a results file with one passed test."""
    return ElementTree.tostring(_single(test_name, 0, class_name, testcase_name)[0])


def _single(
    test_name: str, failures: int, class_name: str, testcase_name: str
) -> tuple[ElementTree.Element, ElementTree.Element]:
    attributes = {"tests": "1", "failures": str(failures), "time": "1", "errors": "0", "name": test_name}
    suite = ElementTree.Element("testsuite", attributes)
    case = {"name": testcase_name, "status": "run", "time": "1", "classname": class_name}
    return suite, ElementTree.SubElement(suite, "testcase", case)
