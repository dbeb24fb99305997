"""The command `catkin_test_results`."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.ros.catkin.commands.test_results import Counts, main, read_counts

BAD = '<testsuite tests="3" errors="1" failures="0"/>'
GOOD = '<testsuite tests="2" errors="0" failures="0"/>'
SKIPPED = '<testsuite tests="3" errors="0" failures="0" skipped="2"/>'


def write(folder: Path, **texts: str) -> Path:
    (folder / "p").mkdir()
    for name, text in texts.items():
        (folder / "p" / f"{name}.xml").write_text(text)
    return folder


def test_what_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(write(tmp_path, bad=BAD, good=GOOD, skipped=SKIPPED, other="<a/>", broken="<testsuite"))
    assert main([folder]) == 1
    lines = [
        "p/bad.xml: 3 tests, 1 errors, 0 failures, 0 skipped",
        "p/skipped.xml: 3 tests, 0 errors, 0 failures, 2 skipped",
        "Summary: 8 tests, 1 errors, 0 failures, 2 skipped",
    ]
    assert capsys.readouterr().out.splitlines() == lines
    assert main(["--all", folder]) == 1
    assert capsys.readouterr().out.splitlines() == [
        'Skipping "p/broken.xml": unclosed token: line 1, column 0',
        "Skipping \"p/other.xml\": the root tag is neither 'testsuite' nor 'testsuites'",
        lines[0],
        "p/good.xml: 2 tests",
        *lines[1:],
    ]
    assert main(["--verbose", folder]) == 1
    assert f"Full test results for 'p/bad.xml'\n{'-' * 49}\n{BAD}\n" in capsys.readouterr().out


def test_what_cannot_be_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = write(tmp_path)
    (folder / "p" / "bad.xml").write_text(
        f'<?xml version="1.0" encoding="latin-1"?><!-- \xe4 -->{BAD}', encoding="latin-1"
    )
    (folder / "p" / "folder.xml").mkdir()
    assert main(["--all", "--verbose", str(folder)]) == 1
    out = capsys.readouterr().out
    assert "<!-- \ufffd -->" in out
    assert f'Skipping "{Path("p", "folder.xml")}": ' in out


def test_status(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(write(tmp_path, good=GOOD, skipped=SKIPPED))]) == 0
    assert main([str(tmp_path / "no")]) == 1
    assert f'Test results directory "{tmp_path / "no"}" does not exist' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "counts"),
    [
        (GOOD, Counts(2)),
        ('<testsuite tests="2" errors="0" failures="0" skip="1"/>', Counts(2, skipped=1)),
        ('<testsuite tests="2" errors="0" failures="0" disabled="1"/>', Counts(2, skipped=1)),
        # This is the format that pytest writes.
        (f'<testsuites name="pytest tests">{GOOD}{BAD}</testsuites>', Counts(5, 1)),
    ],
)
def test_counts(text: str, counts: Counts, tmp_path: Path) -> None:
    file = tmp_path / "x.xml"
    file.write_text(text)
    assert read_counts(file) == counts


@pytest.mark.parametrize(
    "text", ["", "<testsuite", "<a/>", "<testsuite/>", '<testsuite tests="a" errors="0" failures="0"/>']
)
def test_what_is_no_file_of_results(text: str, tmp_path: Path) -> None:
    file = tmp_path / "x.xml"
    file.write_text(text)
    with pytest.raises(ValueError, match=r"\w"):
        read_counts(file)
