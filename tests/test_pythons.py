"""`make pythons`: which of the Pythons that it finds are selected, and the installation alone."""

from __future__ import annotations

import sys

import pytest

from tools import pythons
from tools.pythons import choose

FOUND = ["3.10", "3.13", "3.13t", "3.14t"]


@pytest.mark.parametrize(
    ("words", "chosen"),
    [
        (["oldest", "newest"], ["3.10", "3.13"]),
        (["3.13t", "3.10"], ["3.10", "3.13t"]),
        (["newest", "3.13"], ["3.13"]),
    ],
)
def test_words_choose_versions(words: list[str], chosen: list[str]) -> None:
    assert choose(words, FOUND) == chosen


def test_only_python_is_oldest_and_newest() -> None:
    assert choose(["oldest", "newest"], ["3.11"]) == ["3.11"]
    assert choose(["newest"], ["3.14t"]) == ["3.14t"]


def test_version_that_is_not_there_is_refused() -> None:
    with pytest.raises(LookupError, match=r"not found: 3\.9; there are 3\.10, 3\.13"):
        choose(["3.9", "oldest"], FOUND)


def test_install_runs_no_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    monkeypatch.setattr(pythons, "make_environment", lambda python, _label: made.append(python))
    assert pythons.main(["--install", sys.executable, "--", "tests/no_such_folder"]) == 0
    assert made == [sys.executable]
