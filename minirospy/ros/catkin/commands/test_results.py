"""`catkin_test_results`: summarize the JUnit XML files below a folder.

Source: http://wiki.ros.org/catkin/commands (catkin_test_results).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from minirospy.base.errors import MinirospyError
from minirospy.base.xml_text import XmlError, check_xml
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command

__all__ = ["COMMAND", "Counts", "main", "read_counts", "results_below"]

_LINE = "-" * 49
_SKIPPED = ("skip", "skipped", "disabled")


class Counts(NamedTuple):
    """The numbers of tests, errors, failures and skipped tests."""

    tests: int = 0
    errors: int = 0
    failures: int = 0
    skipped: int = 0

    def __str__(self) -> str:
        return f"{self.tests} tests, {self.errors} errors, {self.failures} failures, {self.skipped} skipped"

    @property
    def is_bad(self) -> bool:
        """Return whether there are errors or failures."""
        return bool(self.errors or self.failures)

    def plus(self, other: Counts) -> Counts:
        """Add ``other`` to these counts and return the sum."""
        return Counts(*(mine + theirs for mine, theirs in zip(self, other, strict=True)))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0 if all tests passed, or 1 if a test failed or had an error, or if the folder does not exist."""
    return COMMAND.main(argv)


def read_counts(file: Path) -> Counts:
    """Return a file's counts, summed over its suites. Raise ValueError with the reason if it is not a result file."""
    try:
        check_xml(text := file.read_bytes())
        root = ElementTree.fromstring(text)
        if root.tag not in ("testsuite", "testsuites"):
            raise ValueError("the root tag is neither 'testsuite' nor 'testsuites'")
        suites = [root] if root.tag == "testsuite" else [each for each in root if each.tag == "testsuite"]
        counts = Counts()
        for suite in suites:
            tests, errors, failures = (int(suite.attrib[key]) for key in ("tests", "errors", "failures"))
            skipped = next((int(suite.attrib[key]) for key in _SKIPPED if key in suite.attrib), 0)
            counts = counts.plus(Counts(tests, errors, failures, skipped))
    except (ElementTree.ParseError, XmlError, OSError) as error:
        raise ValueError(str(error)) from error
    except KeyError as error:
        raise ValueError(f"its <testsuite> has no attribute {error}") from error
    return counts


def results_below(folder: Path) -> Iterator[tuple[Path, Counts | ValueError]]:
    """Yield the XML files below a folder, sorted, each with its counts, or with the error if it is not a result file."""
    for file in sorted(folder.rglob("*.xml")):
        try:
            yield file, read_counts(file)
        except ValueError as error:
            yield file, error


def _parser() -> Parser:
    parser = Parser(
        prog="catkin_test_results",
        description="Outputs a summary of the test results. If there are any test errors or failures the exit "
        "status is 1.",
    )
    parser.add_argument(
        "test_results_dir",
        nargs="?",
        type=Path,
        default=Path(),
        help="the folder (default: the current one)",
        completer="folders",
    )
    parser.add_argument(
        "--all", action="store_true", help="show also files without errors and failures, and those left out"
    )
    parser.add_argument("--verbose", action="store_true", help="show the files with errors or failures")
    return parser


def _results(test_results_dir: Path, all: bool, verbose: bool) -> int:
    folder = test_results_dir
    if not folder.is_dir():
        raise MinirospyError(f'Test results directory "{folder}" does not exist')

    found = [(file, file.relative_to(folder), counts) for file, counts in results_below(folder)]
    total = Counts()
    for file, name, counts in found:
        if isinstance(counts, Counts):
            total = total.plus(counts)
            if verbose and counts.is_bad:
                text = file.read_text(encoding="utf-8", errors="replace")
                print(f"Full test results for '{name}'\n{_LINE}\n{text}\n{_LINE}")
        elif all:
            print(f'Skipping "{name}": {counts}')

    for _, name, counts in found:
        if isinstance(counts, Counts) and (counts.is_bad or counts.skipped):
            print(f"{name}: {counts}")
        elif isinstance(counts, Counts) and all:
            print(f"{name}: {counts.tests} tests")

    print(f"Summary: {total}")
    return int(total.is_bad)


COMMAND = Command("catkin_test_results", _parser, _results)

if __name__ == "__main__":
    sys.exit(main())
