"""The summary of a launch, with parameter values shortened as in roslaunch."""

from __future__ import annotations

import pytest

from minirospy.ros.roslaunch.launcher.summary import summary


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ('<?xml version="1.0" ?>\n<robot name="arm">\n</robot>\n', '<?xml version="1....'),
        ("<robot>\n<link/>\n</robot>", "<...>"),
        ("one line\n", "one line"),
        ("tab\there", "<...>"),
        ("grün", "<...>"),
        ("12345678901234567890", "12345678901234567890"),
        ("123456789012345678901", "12345678901234567..."),
        (["/src"], "['/src']"),
        ("", ""),
    ],
)
def test_values_are_shortened_as_by_roslaunch(value: object, shown: str) -> None:
    assert f" * /p: {shown}\n" in summary([], {"/p": value}, [])
