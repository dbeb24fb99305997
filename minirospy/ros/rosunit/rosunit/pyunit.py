"""Provides the names in ROS's module rosunit.pyunit."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from minirospy.base.installation import install_command
from minirospy.ros.rosunit.runner.unit import (
    XML_OUTPUT_FLAG,
    create_xml_runner,
    print_unittest_summary,
    unitrun,
)

__all__ = [
    "XML_OUTPUT_FLAG",
    "create_xml_runner",
    "print_unittest_summary",
    "start_coverage",
    "stop_coverage",
    "unitrun",
]

_running: list[Any] = []


def start_coverage(packages: Sequence[str]) -> None:
    """Start measuring coverage, adding to earlier results. Print a warning if the package coverage is missing."""
    try:
        import coverage  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        _warn_of_coverage()
        return
    measured = coverage.Coverage()
    measured.load()
    measured.start()
    _running[:] = [measured]


def stop_coverage(packages: Sequence[str], html: str | None = None) -> None:
    """Stop measuring coverage and print the coverage of ``packages``. If ``html`` is given, write a report to that folder."""
    if not _running:
        return
    measured = _running.pop()
    measured.stop()
    measured.save()
    path = Path(".coverage-modules")
    known = path.read_text(encoding="utf-8").split() if path.exists() else []
    path.write_text("\n".join({*known, *packages}) + "\n", encoding="utf-8")
    modules: list[Any] = []
    for package in packages:
        try:
            importlib.import_module(package)
        except ImportError:
            print(f"WARNING: cannot import '{package}', will not generate coverage report", file=sys.stderr)
            return
        found = [each for name, each in list(sys.modules.items()) if name.startswith(package) and each]
        modules += found
        measured.report(found, show_missing=False)
        for module in found:
            file, *_, missing, _ = measured.analysis2(module)
            print(f"\n{file}:\nMissing lines: {missing}")
    if html:
        print("=" * 80 + f"\ngenerating html coverage report to {html}\n" + "=" * 80)
        measured.html_report(modules, directory=html)


def _warn_of_coverage() -> None:
    print("WARNING: cannot import python-coverage, coverage tests will not run.", file=sys.stderr)
    print(f"To install coverage, run '{install_command('coverage')}'", file=sys.stderr)
