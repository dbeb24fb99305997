"""Services that the master lists in another order were registered again."""

from __future__ import annotations

import pytest

from minirospy.introspect.snapshot import moved


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("abc", "abc", ""),
        ("abc", "bca", "a"),
        ("abc", "ab", ""),
        ("abc", "abcd", ""),
        ("abcd", "bdac", "ac"),
        ("abc", "cdx", ""),
        ("", "ab", ""),
    ],
)
def test_names_that_moved_behind_others_are_found(before: str, after: str, expected: str) -> None:
    assert moved(dict.fromkeys(before, ()), dict.fromkeys(after, ())) == [*expected]
