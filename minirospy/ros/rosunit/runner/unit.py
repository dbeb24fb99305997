"""Runs a TestCase's unit tests in this process; writes JUnit XML and prints a summary. ``rosunit`` re-exports this module.

Source: http://wiki.ros.org/rosunit, http://wiki.ros.org/unittest.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import time
import traceback
import unittest
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TextIO

from minirospy.ros.rosunit.runner.junit import (
    Result,
    TestCaseResult,
    TestError,
    TestFailure,
    TestInfo,
    coloured,
    names_of,
    report,
)
from minirospy.workspace.folders import results_dir

__all__ = [
    "XML_OUTPUT_FLAG",
    "XMLTestRunner",
    "begin_results",
    "create_xml_runner",
    "print_runner_summary",
    "print_unittest_summary",
    "rostest_name_from_path",
    "unitrun",
    "xml_results_file",
]

XML_OUTPUT_FLAG = "--gtest_output=xml:"
_LINE = "-" * 61

# Folders whose modules are omitted from tracebacks.
_MACHINERY = {Path(unittest.__file__).parent, Path(__file__).parent}

ExcInfo = tuple[type[BaseException], BaseException, TracebackType] | tuple[None, None, None]


def unitrun(
    package: str,
    test_name: str,
    test: type[unittest.TestCase] | str,
    sysargs: Sequence[str] | None = None,
    coverage_packages: Sequence[str] | None = None,
) -> None:
    """Run a TestCase, given as a class or a name. A test file calls this as its main function.

    With ``--text`` in ``sysargs`` (default: ``sys.argv``), print like unittest; else write the results to
    ``~/.ros/test_results/PACKAGE/rosunit-NAME.xml``, or to the file given by ``--gtest_output=xml:FILE``. Raise
    SystemExit(1) if a test fails. ``coverage_packages`` has no effect: run the file under coverage.py instead.
    """
    arguments = sys.argv if sysargs is None else sysargs
    loader = unittest.TestLoader()
    suite = loader.loadTestsFromName(test) if isinstance(test, str) else loader.loadTestsFromTestCase(test)
    result: unittest.TestResult
    try:
        if "--text" in arguments or "-t" in arguments:
            result = unittest.TextTestRunner(verbosity=2).run(suite)
        else:
            result = create_xml_runner(package, test_name, _output_file(arguments)).run(suite)
    except KeyboardInterrupt as error:
        where = _told((type(error), error, error.__traceback__))[1].strip() if error.__traceback__ else ""
        print(f"interrupted in\n  {where}", file=sys.stderr)
        sys.exit(1)
    print_unittest_summary(result)
    sys.stdout.flush()
    if not result.wasSuccessful():
        sys.exit(1)


def create_xml_runner(
    test_pkg: str, test_name: str, results_file: str | None = None, is_rostest: bool = False
) -> XMLTestRunner:
    """Return a runner that writes ``results_file`` (default: rosunit's file)."""
    file = Path(results_file or xml_results_file(test_pkg, test_name, is_rostest))
    begin_results(file)
    return XMLTestRunner(file)


def begin_results(file: Path) -> None:
    """Create the results file's folder, delete the file of an earlier run and print its path."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.unlink(missing_ok=True)
    print(f"[ROSUNIT] Outputting test results to {file.absolute()}", flush=True)


def xml_results_file(
    test_pkg: str, test_name: str, is_rostest: bool = False, env: Mapping[str, str] | None = None
) -> str:
    """Return the path of a test's results: ``PACKAGE/rosunit-NAME.xml`` or ``rostest-NAME.xml`` in the results folder."""
    kind = "rostest" if is_rostest else "rosunit"
    name = test_name.replace("/", "_").replace(os.sep, "_")
    return os.path.join(results_dir(env), test_pkg, f"{kind}-{name}.xml")


def rostest_name_from_path(pkg_dir: str, test_file: str) -> str:
    """Return a test file's name for the results: ``test/hz.test`` in its package becomes ``test_hz``."""
    name = (
        test_file.removeprefix(pkg_dir).removeprefix(os.sep) if test_file.startswith(pkg_dir) else test_file
    )
    return os.path.splitext(name)[0].replace(os.sep, "_").replace("/", "_")


def print_unittest_summary(result: unittest.TestResult) -> None:
    """Print a run's counts and the names of the tests that did not pass."""
    is_good = result.wasSuccessful()
    print(f"{_LINE}\nSUMMARY:")
    print(coloured(" * RESULT: SUCCESS", "32") if is_good else " * RESULT: FAIL")
    print(f" * TESTS: {result.testsRun}")
    print(f" * ERRORS: {len(result.errors)} [{', '.join(names_of(result.errors))}]")
    print(f" * FAILURES: {len(result.failures)} [{', '.join(names_of(result.failures))}]\n")


def print_runner_summary(
    runner_results: unittest.TestResult, junit_results: Result, runner_name: str = "ROSUNIT"
) -> None:
    """Print each case in the tests' results, then the counts, including the runner's own errors."""
    print(report(junit_results, runner_name, len(runner_results.errors), names_of(runner_results.failures)))


# --- the runner


class XMLTestRunner:
    """Runs tests, prints a line for each, and finally writes the results to a file or stream.

    The tests' output is written only to the file.
    """

    def __init__(self, stream: Path | TextIO | None = None) -> None:
        self._stream = stream

    def run(self, test: unittest.TestSuite | unittest.TestCase) -> unittest.TestResult:
        """Run the tests; return the result with unittest's counts."""
        result = _Recorder(sys.stdout)
        started = time.perf_counter()
        with _captured() as (out, err):
            test(result)
        result.shown.time = time.perf_counter() - started
        shown = result.shown
        shown.num_tests = result.testsRun
        shown.num_errors = len(result.errors)
        shown.num_failures = len(result.failures)
        shown.system_out, shown.system_err = _cdata(out.getvalue()), _cdata(err.getvalue())
        if isinstance(self._stream, Path):
            shown.write(self._stream)
        else:
            (self._stream or sys.stdout).write(shown.xml().decode("utf-8"))
        return result


class _Recorder(unittest.TestResult):
    """A unittest result that also records each case for JUnit XML and prints a line for it."""

    def __init__(self, terminal: TextIO) -> None:
        super().__init__()
        self.shown = Result("unittest.suite.TestSuite")
        self._terminal = terminal
        self._case: TestCaseResult | None = None
        self._begun = 0.0

    def startTest(self, test: unittest.TestCase) -> None:
        super().startTest(test)
        self._case = _case_of(test)
        self._begun = time.perf_counter()

    def stopTest(self, test: unittest.TestCase) -> None:
        super().stopTest(test)
        assert self._case is not None
        if isinstance(sys.exc_info()[1], KeyboardInterrupt):
            return
        self._case.time = time.perf_counter() - self._begun
        self._finish(self._case)
        self._case = None

    def addError(self, test: unittest.TestCase, err: ExcInfo) -> None:
        super().addError(test, err)
        self._note(test, TestError(*_told(err)))

    def addFailure(self, test: unittest.TestCase, err: ExcInfo) -> None:
        super().addFailure(test, err)
        self._note(test, TestFailure(*_told(err)))

    def addSubTest(self, test: unittest.TestCase, subtest: unittest.TestCase, err: ExcInfo | None) -> None:
        super().addSubTest(test, subtest, err)
        if err is None:
            return
        kind, text = _told(err)
        text = f"{subtest._subDescription()}: {text}"  # type: ignore[attr-defined]
        is_failure = err[0] is not None and issubclass(err[0], test.failureException)
        self._note(test, (TestFailure if is_failure else TestError)(kind, text))

    def addUnexpectedSuccess(self, test: unittest.TestCase) -> None:
        # Like wasSuccessful(), count an unexpected success as a failure.
        super().addUnexpectedSuccess(test)
        text = "the test was expected to fail, and did not"
        self.failures.append((test, text))
        self._note(test, TestFailure("AssertionError", text))

    def addSkip(self, test: unittest.TestCase, reason: str) -> None:
        super().addSkip(test, reason)
        if self._case is not None:
            self._case.skipped = reason

    def _note(self, test: unittest.TestCase, info: TestInfo) -> None:
        # If setUpClass or setUpModule fails, startTest has not been called.
        case = self._case or _case_of(test)
        (case.add_error if isinstance(info, TestError) else case.add_failure)(info)
        if self._case is None:
            self._finish(case)

    def _finish(self, case: TestCaseResult) -> None:
        self.shown.add_test_case_result(case)
        print(case.line, file=self._terminal, flush=True)


def _case_of(test: unittest.TestCase) -> TestCaseResult:
    # for example ``__main__.Case.test_x``, or ``setUpClass (__main__.Case)``
    name, _, place = test.id().partition(" (")
    where, _, last = name.rpartition(".")
    case = TestCaseResult(last)
    case.classname = place.rstrip(")") or where
    return case


def _told(err: ExcInfo) -> tuple[str, str]:
    """Return an exception's name, and its message with the traceback, omitting unittest's lines."""
    kind, error, trace = err
    if kind is None or error is None:
        return "", ""
    frames = [frame for frame in traceback.extract_tb(trace) if Path(frame.filename).parent not in _MACHINERY]
    return kind.__name__, f"{error}\n{''.join(traceback.format_list(frames))}"


@contextlib.contextmanager
def _captured() -> Iterator[tuple[io.StringIO, io.StringIO]]:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        yield out, err


def _cdata(text: str) -> str:
    return f"<![CDATA[\n{text}\n]]>"


def _output_file(arguments: Sequence[str]) -> str | None:
    found = [word.removeprefix(XML_OUTPUT_FLAG) for word in arguments if word.startswith(XML_OUTPUT_FLAG)]
    return (found[0] or None) if found else None
